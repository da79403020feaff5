"""Measure how the upper bound of the isotropy falls with the time spent on it.

Usage: python benchmarks/isotropy_bound.py [--robot pr2] [--resolutions 0.05 0.02 ...]

The bound of P_R + P_M where every goal is reached is 1 plus this bound. Times are processor times.
"""

from __future__ import annotations

import argparse
import time

from table import header, parser, record, row, save

from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain
from tcs.placement.refinement.dexterity_bound import descent

COLUMNS = ("resolution", "halvings", "bound of the isotropy", "bound of P_R + P_M", "time [s]")


def main() -> None:
    """Measure each resolution and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--robot", default="pr2")
    resolutions = [0.05, 0.02, 0.01, 0.008, 0.004]
    command_line.add_argument("--resolutions", type=float, nargs="+", default=resolutions)
    options = command_line.parse_args()
    header()
    rows = []
    for resolution in options.resolutions:
        rows.append(measured(resolution, options))
        row(rows[-1][0], ", ".join(rows[-1][1:]))
        record("rows", COLUMNS, rows)
        save(options)


def measured(resolution: float, options: argparse.Namespace) -> list[str]:
    """Return the row of one resolution."""
    chain, _ = arm_chain(Scene(SceneSpec(load_robot(options.robot), EMPTY_ENVIRONMENT)))
    begun = time.process_time()
    course = descent(chain, resolution)
    seconds = time.process_time() - begun
    bound = f"{course[-1]:.4f}", f"{1.0 + course[-1]:.4f}"
    return [f"{resolution:g}", str(len(course) - 1), *bound, f"{seconds:.1f}"]


if __name__ == "__main__":
    main()
