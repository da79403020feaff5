"""Run the commands of docs/first-run.md, and record what they print.

Usage: python benchmarks/first_run.py

The machine code should be ready: the notice of the first compilation is not part of the output.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

from table import header, parser, record_text, save

FILE = "shaving-wheelchair-pr2.tcs"
COMMANDS = {
    "score": "score shaving --environment wheelchair",
    "select": f"select {FILE} --here 1.4 -1.2 180",
    "explain": f"explain {FILE} --goal 7 --here 1.1 0.7 180",
    "verify": f"verify {FILE}",
    "evaluate": f"evaluate {FILE}",
}
"""Arguments of `tcs`, by the name under which the page shows the output."""
WIDTH = 112
"""Columns of the terminal: those of the page."""


def main() -> None:
    """Run every command in an empty folder, print what it prints and record it."""
    options = parser(__doc__).parse_args()
    header()
    environment = {**os.environ, "COLUMNS": str(WIDTH), "NO_COLOR": "1"}
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in COMMANDS.items():
            done = subprocess.run(
                [sys.executable, "-m", "tcs", *arguments.split()],
                cwd=folder, env=environment, check=True, capture_output=True, text=True,
            )  # fmt: skip
            lines = [line.rstrip() for line in done.stdout.strip("\n").splitlines()]
            print(f"\n$ tcs {arguments}", *lines, sep="\n", flush=True)
            record_text(name, "\n".join(lines))
    save(options)


if __name__ == "__main__":
    main()
