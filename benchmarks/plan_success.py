"""How often the motions of a plan stay free, or can be planned anew, when the person is displaced.

Usage: python benchmarks/plan_success.py FILE [FILE ...] [--samples 200] [--seed 0]

The plan of each score file is that of its best set, without a current state.
"""

from __future__ import annotations

import sys
from pathlib import Path

from table import cell, header, parser, row, save

import tcs
from tcs.motion import evaluate_plan
from tcs.output.words import percentage
from tcs.placement.robustness import Mean


def main() -> int:
    """Plan the best set of every file and displace its environment."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="+", type=Path)
    command_line.add_argument("--samples", type=int, default=200)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("samples", str(options.samples))
    for path in options.files:
        file = tcs.load(path)
        # The tables of a file with observed states follow one another.
        first = file.nominal_index * file.configurations.size
        best = [first + member for member in file.nominal.sets.best]
        plan = tcs.plan(file, best, seed=options.seed)
        success = evaluate_plan(plan, samples=options.samples, seed=options.seed)
        cells = {
            "stops": str(len(plan.stops)),
            "goals done": f"{plan.goals_done} of {len(plan.results)}",
            "blind": with_interval(success.free),
            "replanned": with_interval(success.done_again),
        }
        for column, text in cells.items():
            cell("success", path.stem, column, text)
        row(path.stem, ", ".join(f"{column} {text}" for column, text in cells.items()))
    save(options)
    return 0


def with_interval(mean: Mean | None) -> str:
    """Return a mean and its 95 % interval."""
    if mean is None:
        return "-"
    low, high = mean.ci95 or (mean.mean, mean.mean)
    return f"{percentage(mean.mean)} ({percentage(low)} to {percentage(high)})"


if __name__ == "__main__":
    sys.exit(main())
