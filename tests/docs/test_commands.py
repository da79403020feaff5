"""Every command line of the README and the docs is one that `tcs` understands."""

import functools
import re
import shlex
from pathlib import Path

import pytest
import typer.main

from tcs.cli.app import app
from tcs.model.tasks.task_files import GoalEntry, SurfaceEntry, TaskFile

CHECKOUT = Path(__file__).resolve().parents[2]
PAGES = [CHECKOUT / "README.md", *sorted((CHECKOUT / "docs").rglob("*.md"))]


def command_lines() -> list:
    found = []
    for page in PAGES:
        # Blocks of every language are matched, so that the end of one is not taken for the start
        # of another.
        text = page.read_text(encoding="utf-8")
        blocks = re.findall(r"^ *```(\w*)[^\n]*\n(.*?)^ *```", text, flags=re.S | re.M)
        lines = (
            "".join(block for language, block in blocks if language in ("", "sh"))
            .replace("\\\n", " ")
            .splitlines()
        )
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
    while words and hasattr(command, "commands") and not words[0].startswith("-"):
        command = command.commands[words.pop(0)]
    # Parses, and refuses what it does not know or lacks; nothing is run.
    command.make_context(str(command.name), words)


@functools.cache
def tcs_command():
    return typer.main.get_command(app)


def options_of(command) -> set[str]:
    below = getattr(command, "commands", {}).values()
    own = {o for parameter in command.params for o in (*parameter.opts, *parameter.secondary_opts)}
    return own.union({"--help"}, *map(options_of, below))


def options_of_scripts() -> set[str]:
    files = [*(CHECKOUT / "scripts").glob("*.py"), *(CHECKOUT / "benchmarks").glob("*.py")]
    found = [re.findall(r'"(--[a-z-]+)"', path.read_text(encoding="utf-8")) for path in files]
    return {option for options in found for option in options}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_options_named_in_a_sentence_are_there(page):
    known = options_of(typer.main.get_command(app)) | options_of_scripts()
    spans = re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8"))
    named = {option for span in spans for option in re.findall(r"(?<!\S)--[a-z][a-z0-9-]*", span)}
    assert named - known == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_named_in_a_sentence_are_there(page):
    spans = re.findall(r"`tcs\s+([a-z-]+)([^`]*)`", page.read_text(encoding="utf-8"))
    commands = typer.main.get_command(app).commands
    for verb, rest in spans:
        assert verb in commands, verb
        command = commands[verb]
        for word in rest.split():
            command = getattr(command, "commands", {}).get(word, command)
        assert set(re.findall(r"(?<!\S)--[a-z][a-z0-9-]*", rest)) <= options_of(command), (
            verb,
            rest,
        )


def test_an_unknown_option_is_refused():
    with pytest.raises(Exception, match="No such option: --enviroment"):
        test_line_is_understood("tcs score shaving --enviroment wheelchair")


def keys_in_tables(text: str) -> set[str]:
    return set(re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (.*?) \|", text, flags=re.M))))


def test_table_of_task_keys_is_complete():
    text = (CHECKOUT / "docs" / "adding.md").read_text(encoding="utf-8")
    section = text[text.index("## A task") : text.index("## A robot")]
    start = section.index("### Goals all over a surface")
    of_task, of_surface = section[:start], section[start : section.index("\n#", start + 1)]
    assert keys_in_tables(of_task) == set(TaskFile.model_fields)
    assert keys_in_tables(of_surface) == set(SurfaceEntry.model_fields)
    assert all(f"`{key}`" in section for key in GoalEntry.model_fields)
