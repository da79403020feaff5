"""Code run in a new interpreter that has imported nothing."""

from __future__ import annotations

import subprocess
import sys


def fresh(code: str) -> str:
    """Return what the code prints in a new interpreter."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()
