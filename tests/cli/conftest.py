from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tcs.cli.app import app
from tcs.store import save_scores
from tests.store.example import score_file


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
