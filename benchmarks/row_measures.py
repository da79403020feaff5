"""Measure rows of Table I with other dexterity measures than the paper's isotropy.

Usage: python benchmarks/row_measures.py [--rows TASK/ENVIRONMENT ...] [--samples 1000] [--seed 0]
           [--jobs 2]

By default the rows in which the best set by P_R + P_M stays below the paper's mean. Each is scored
with the isotropy and with its penalty near joint limits, on the bed with the person at the nominal
position; the set with the greatest P_R + P_M is evaluated under the paper's errors.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from printed_grid import at_nominal_position
from table import header, parser, record, row, save

import tcs
from tcs.placement.robustness import evaluate
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.output.words import mean_and_std

BELOW = (
    "shaving/wheelchair",
    "brushing/wheelchair",
    "shaving/bed-no-wall",
    "shaving/bed",
    "scratching_forearm_left/bed",
)
"""Rows below the paper's mean."""
MEASURES = ("isotropy", "isotropy-limited")


def main() -> None:
    """Evaluate every row with each measure and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", metavar="TASK/ENVIRONMENT", default=list(BELOW))
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    columns, rows = ["task, environment", "paper, Table I", *MEASURES], []
    print(" | ".join(columns))
    with tempfile.TemporaryDirectory() as folder:
        for name in options.rows:
            task, environment = name.split("/")
            published = load_paper().published(task, environment)
            cells = [f"{task.replace('_', ' ')}, {environment}"]
            cells.append(f"{published.mean:.1f} ({published.std:.1f})" if published else "–")
            nominal: str | Path = environment
            if environment.startswith("bed"):
                nominal = at_nominal_position(environment, Path(folder))
            for measure in MEASURES:
                file = tcs.score(
                    task, nominal, "pr2", measure=measure, jobs=options.jobs, paper=True
                )
                found = evaluate(
                    file,
                    samples=options.samples,
                    seed=options.seed,
                    jobs=options.jobs,
                    body_collisions="paper",
                )
                cells.append(mean_and_std(found))
            rows.append(cells)
            print(" | ".join(cells), flush=True)
    record("rows", columns, rows)
    row("rows", str(len(rows)))
    save(options)


if __name__ == "__main__":
    main()
