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
    """What a command said, and how it ended."""

    code: int
    out: str
    err: str

    @property
    def json(self):
        """The one object on stdout."""
        return json.loads(self.out)


@pytest.fixture
def tcs_command() -> Callable[..., Ran]:
    """Runs `tcs` with these words, in this process."""

    def run(*words: object) -> Ran:
        result = CliRunner().invoke(app, [str(word) for word in words])
        # Only what a command lets through on purpose; the rest is a mistake with a traceback.
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Ran(result.exit_code, result.stdout, result.stderr)

    return run


@pytest.fixture
def process() -> Callable[..., Ran]:
    """Runs `tcs` with these words, in a process of its own whose output is piped."""

    def run(*words: object, before: str = "", cwd: Path | None = None) -> Ran:
        code = f"import sys\n{before}\nfrom tcs.cli import main\nmain()"
        checkout = Path(__file__).resolve().parents[2]
        done = subprocess.run(
            [sys.executable, "-c", code, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            cwd=cwd,
            env={**os.environ, "PYTHONPATH": str(checkout)},
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
    """Makes a score file as `tcs.score` might return it."""

    def make(**changes: Any) -> tcs.ScoreFile:
        return score_file(metadata={**METADATA, "timings": TIMINGS}, **changes)

    return make


@pytest.fixture
def stand_in(monkeypatch, example):
    """Calls of `tcs.score`, which returns an example at once."""
    calls = []

    def score(*arguments, **options):
        calls.append((arguments, options))
        return example()

    monkeypatch.setattr(tcs, "score", score)
    return calls
