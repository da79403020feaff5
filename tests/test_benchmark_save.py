"""The command that saves every benchmark runs what has changed, and continues where it was."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "benchmarks" / "save_all.py"


@pytest.fixture
def saving(tmp_path, monkeypatch):
    """Return the script as a module, on a checkout of two scripts of which one fails."""
    spec = importlib.util.spec_from_file_location("save_all", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("tcs", "models", "tasks", "benchmarks"):
        (tmp_path / name).mkdir()
    (tmp_path / "tcs" / "kernel.py").write_text("STEP = 1\n", encoding="utf-8")
    good = "import sys\nopen('runs', 'a').write(' '.join(sys.argv[1:]) + ';')\n"
    (tmp_path / "benchmarks" / "good.py").write_text(good, encoding="utf-8")
    (tmp_path / "benchmarks" / "bad.py").write_text("raise SystemExit(3)\n", encoding="utf-8")
    monkeypatch.setattr(module, "CHECKOUT", tmp_path)
    monkeypatch.setattr(module, "STAMPS", tmp_path / "out")
    monkeypatch.setattr(module, "PARTS", {"bad": (), "good": ("--size", "3")})
    return module


def run(module, monkeypatch, *arguments) -> int:
    monkeypatch.setattr(sys, "argv", ["save_all.py", *arguments])
    return module.main()


def test_what_was_saved_is_left_out_until_something_changes(saving, monkeypatch, capsys):
    runs = saving.CHECKOUT / "runs"
    assert run(saving, monkeypatch) == 1
    assert runs.read_text() == "--size 3 --save;"
    output = capsys.readouterr()
    assert "bad          failed with exit code 3" in output.out
    assert "good         saved in" in output.out
    assert "failed: bad" in output.err
    assert run(saving, monkeypatch, "--only", "good") == 0
    assert runs.read_text() == "--size 3 --save;"
    assert "good         saved before" in capsys.readouterr().out
    (saving.CHECKOUT / "tcs" / "kernel.py").write_text("STEP = 2\n", encoding="utf-8")
    assert run(saving, monkeypatch, "--only", "good") == 0
    assert runs.read_text() == 2 * "--size 3 --save;"
    assert run(saving, monkeypatch, "--only", "good", "--again") == 0
    assert runs.read_text() == 3 * "--size 3 --save;"


def test_the_list_runs_nothing(saving, monkeypatch, capsys):
    assert run(saving, monkeypatch, "--list") == 0
    assert capsys.readouterr().out.count("to be run") == 2
    assert not (saving.CHECKOUT / "runs").exists()


def test_every_part_is_a_script_that_saves(saving):
    spec = importlib.util.spec_from_file_location("save_all", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in module.PARTS:
        text = (SCRIPT.parent / f"{name}.py").read_text(encoding="utf-8")
        assert re.search(r"\bsave\(options\b", text), name
