"""Code run in an interpreter of its own, which has imported nothing yet."""

from __future__ import annotations

import subprocess
import sys


def fresh(code: str) -> str:
    """What a new interpreter prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()
