"""Every command, file and program in the README works."""

import re
import shlex
from pathlib import Path

import pytest
import typer.main

import tcs
from tcs.cli.app import app
from tcs.model.scene import load_environment
from tests.placement.store.example import score_file

CHECKOUT = Path(__file__).resolve().parents[2]
README = (CHECKOUT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.S)


def command_lines() -> list[str]:
    lines = "\n".join(blocks("sh")).splitlines()
    return [line.split("#")[0].strip() for line in lines if line.startswith("tcs ")]


def test_there_are_examples():
    assert len(command_lines()) >= 5
    assert len(blocks("python")) == len(blocks("yaml")) == 1


@pytest.mark.parametrize("line", command_lines())
def test_command_line_is_understood(line):
    _, verb, *words = shlex.split(line)
    command = typer.main.get_command(app).commands[verb]
    # Parses, and refuses what it does not know; nothing is run.
    command.make_context(verb, words)


def test_environment_is_read(tmp_path):
    path = tmp_path / "kitchen.yaml"
    path.write_text(blocks("yaml")[0])
    assert [obstacle.name for obstacle in load_environment(path).obstacles] == ["table"]


def test_python_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    calls = []

    class Sound:
        is_sound = True

    # The functions are tested elsewhere; this checks that the calls are valid.
    monkeypatch.setattr(tcs, "score", lambda *a, **o: calls.append((a, o)) or score_file())
    monkeypatch.setattr(tcs, "verify", lambda *a, **o: calls.append((a, o)) or Sound)
    exec(compile(blocks("python")[0], "README.md", "exec"), {})
    assert "base_yaw_deg" in capsys.readouterr().out
    assert calls[0] == (("shaving",), {"environment": "wheelchair", "robot": "pr2", "jobs": 2})


@pytest.mark.parametrize("target", re.findall(r"\]\(([^)]+)\)", README))
def test_link_leads_somewhere(target):
    if target.startswith("https://"):
        return
    path, _, anchor = target.partition("#")
    assert (CHECKOUT / path).is_file()
    if anchor:
        headings = re.findall(r"^#+ (.*)$", (CHECKOUT / path).read_text("utf-8"), flags=re.M)
        assert anchor in [re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") for text in headings]
