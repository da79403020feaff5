"""Work with blocks that is killed while it writes one of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import tcs

_KILLED = """
import os, signal, sys
from pathlib import Path
import tcs
{before}
from tcs.files.blocks import BlockFolder
file = tcs.load(sys.argv[1])
blocks = BlockFolder(Path(sys.argv[2]))
replace, left = Path.replace, [{number}]
def replaced(self, target):
    if left[0] == 0 and str(target).endswith(".block"):
        os.kill(os.getpid(), signal.SIGKILL)
    left[0] -= str(target).endswith(".block")
    return replace(self, target)
Path.replace = replaced
{work}
"""


def killed_at_block(number: int, file: tcs.ScoreFile, folder: Path, before: str, work: str) -> None:
    """Do some work in a process that is killed between writing a block and renaming it.

    Args:
        number: Number of the block, from 0.
        file: The score file `file` of the work.
        folder: The folder of `blocks`, beside which the score file is written.
        before: Python lines that come first.
        work: Python line that does the work with `file` and `blocks`.
    """
    scores = folder.with_name("scores.tcs")
    tcs.save(scores, file)
    code = _KILLED.format(before=before, number=number, work=work)
    done = subprocess.run(
        [sys.executable, "-c", code, str(scores), str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == -9, done.stderr
