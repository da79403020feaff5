"""Fit the collision primitives of a robot anew and write them to the file its YAML names.

    python scripts/fit_primitives.py pr2

The same meshes give the same file. Prints how much each body's primitives exceed its hull.
"""

from __future__ import annotations

import sys
from pathlib import Path

from tcs.errors import TcsError
from tcs.robots import load_robot, write_primitives
from tcs.robots.fit_robot import fit_robot


def main() -> int:
    """Fit, write, and print the table of docs/robots.md."""
    if len(sys.argv) != 2:
        print("usage: fit_primitives.py ROBOT", file=sys.stderr)
        return 2
    try:
        robot = load_robot(sys.argv[1])
        fits = fit_robot(robot, lambda done, total: print(f"{done}/{total}", file=sys.stderr))
        write_primitives(Path(robot.primitives), [p for f in fits for p in f.fit.primitives])
    except TcsError as error:
        print(error, file=sys.stderr)
        return 1
    print("| body | shapes | hull [l] | union [l] | excess |")
    print("|---|---|---|---|---|")
    for found in fits:
        fit = found.fit
        print(
            f"| {found.body} | {len(fit.primitives)} | {fit.hull * 1e3:.3f} "
            f"| {fit.union * 1e3:.3f} | {fit.excess:.2f} |"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
