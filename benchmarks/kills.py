"""Kill commands with SIGKILL at random moments; count what goes wrong.

Usage: python benchmarks/kills.py [--signals 200] [--seed 0]

Starts tcs score, robustify and population, each also with blocks, report and capability from-ik in
turn and kills them between start and end. Files must be old or new and whole, and the same command
must end the work, remove what is left over and give the same scores. Every count of a fault should
be 0; the exit code is 1 if one is not.
"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
from pathlib import Path

from faults import signals
from table import header, parser, row, save


def main() -> int:
    """Kill commands and print the counts."""
    command_line = parser(__doc__)
    command_line.add_argument("--signals", type=int, default=200)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    with tempfile.TemporaryDirectory() as above:
        rng = random.Random(options.seed)
        faults = signals(Path(above) / "signals", options.signals, rng, (signal.SIGKILL,))
    save(options)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
