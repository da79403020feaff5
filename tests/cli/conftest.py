from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.placement.store import save_scores
from tests.environments import CORNER, write_environment
from tests.placement.store.example import METADATA, score_file

TIMINGS = dict.fromkeys(
    ("compile_seconds", "scoring_seconds", "sets_seconds", "total_seconds"), 0.5
)


@dataclass(frozen=True)
class Ran:
    """Output and exit code of a command."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        """The one object on stdout."""
        return json.loads(self.out)


@pytest.fixture
def tcs_command() -> Callable[..., Ran]:
    """Function that runs `tcs` with the given arguments in this process."""

    def run(*words: object) -> Ran:
        result = CliRunner().invoke(app, [str(word) for word in words])
        # Any exception other than an exit is a defect.
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Ran(result.exit_code, result.stdout, result.stderr)

    return run


@pytest.fixture
def process() -> Callable[..., Ran]:
    """Function that runs `tcs` with the given arguments in a separate process with piped output."""

    def run(*words: object, before: str = "", cwd: Path | None = None) -> Ran:
        code = f"import sys\n{before}\nfrom tcs.cli import main\nmain()"
        checkout = Path(__file__).resolve().parents[2]
        folders = checkout, checkout / "shapes", checkout / "studies"
        done = subprocess.run(
            [sys.executable, "-c", code, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, folders))},
        )
        return Ran(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture
def small_file(tmp_path) -> Path:
    """A small score file of random scores."""
    path = tmp_path / "small.tcs"
    save_scores(path, score_file())
    return path


@pytest.fixture(scope="session")
def corner(tmp_path_factory) -> Path:
    """An environment file of the user's own, with 36 configurations."""
    return write_environment(tmp_path_factory.mktemp("corner"), "corner", CORNER)


@pytest.fixture
def example() -> Callable[..., tcs.ScoreFile]:
    """Function that makes a score file like one of `tcs.score`."""

    def make(**changes: Any) -> tcs.ScoreFile:
        return score_file(metadata={**METADATA, "timings": TIMINGS}, **changes)

    return make


@pytest.fixture
def stand_in(monkeypatch, example):
    """Recorded calls of `tcs.score`, replaced by a function that returns an example."""
    calls = []

    def score(*arguments, **options):
        calls.append((arguments, options))
        return example()

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    return calls
