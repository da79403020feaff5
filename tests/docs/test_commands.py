"""Every command line of the README and the docs is one that `tcs` understands."""

import re
import shlex
from pathlib import Path

import pytest
import typer.main

from tcs.cli.app import app
from tcs.tasks.files import GoalEntry, TaskFile

CHECKOUT = Path(__file__).resolve().parents[2]
PAGES = [CHECKOUT / "README.md", *sorted((CHECKOUT / "docs").rglob("*.md"))]


def command_lines() -> list:
    found = []
    for page in PAGES:
        blocks = re.findall(r"```(?:sh)?\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.S)
        lines = "".join(blocks).replace("\\\n", " ").splitlines()
        found += [
            pytest.param(line, id=f"{page.stem}: {line}")
            for line in map(str.strip, lines)
            if line.startswith("tcs ")
        ]
    return found


def test_there_are_lines():
    assert len(command_lines()) > 40


@pytest.mark.parametrize("line", command_lines())
def test_line_is_understood(line):
    command = typer.main.get_command(app)
    _, *words = shlex.split(line, comments=True)
    while hasattr(command, "commands"):
        command = command.commands[words.pop(0)]
    # Parses, and refuses what it does not know or lacks; nothing is run.
    command.make_context(str(command.name), words)


def test_an_unknown_option_is_refused():
    with pytest.raises(Exception, match="No such option: --enviroment"):
        test_line_is_understood("tcs score shaving --enviroment wheelchair")


def test_table_of_task_keys_is_complete():
    text = (CHECKOUT / "docs" / "adding.md").read_text(encoding="utf-8")
    section = text[text.index("## A task") : text.index("## A robot")]
    told = set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (.*?) \|", section, flags=re.M))))
    assert told == set(TaskFile.model_fields)
    assert all(f"`{key}`" in section for key in GoalEntry.model_fields)
