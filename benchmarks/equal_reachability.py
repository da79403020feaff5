"""Compare both baselines of Table III: sets within 0.98 of the greatest P_R, and sets equal to it.

Usage: python benchmarks/equal_reachability.py [--scores out/scores] [--samples 1000] [--seed 0]
           [--jobs 2]

Without TC-manipulability another set is drawn in each sample. The program of the TCS paper draws
from the sets with P_R of at least 0.98 of the greatest; the print says "equal TC-reachability".
Score files that are missing are made.
"""

from __future__ import annotations

from pathlib import Path

from table import header, parser, record, row, save

import tcs
from tcs.output.words import p_value
from tcs.placement.robustness import Trials, evaluate
from tcs.placement.scoring import default_path
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.output.words import mean_and_std
from tcs_studies.robustness.differences import rank_sum

ROBOT = "pr2"
COLUMNS = (
    *("task, environment", "members", "P_R within 0.98", "sets", "P_R equal", "sets"),
    *("without, paper", "with", "p of with against equal, rank sum"),
)


def main() -> None:
    """Evaluate both baselines on the rows of Table III and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--scores", type=Path, default=Path("out/scores"))
    command_line.add_argument("--samples", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    paper = load_paper()
    rows = []
    print(" | ".join(COLUMNS))
    for task, environment in paper.compared_rows():
        path = options.scores / default_path(task, environment, ROBOT)
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            tcs.save(path, tcs.score(task, environment, ROBOT, jobs=options.jobs, paper=True))
        trials = Trials.of(tcs.load(path))
        sampling = {"samples": options.samples, "seed": options.seed, "jobs": options.jobs}
        for members in (1, 2):
            near, equal = (
                evaluate(trials, select=select, members=members, **sampling)
                for select in ("uniform", "equal")
            )
            best = evaluate(trials, select=("single", "best")[members - 1], **sampling)
            published = paper.compared(task, environment, members)
            printed = published.without if published else None
            rows.append(
                [
                    f"{task.replace('_', ' ')}, {environment}",
                    str(members),
                    *(mean_and_std(near), f"{near.choices:,}"),
                    *(mean_and_std(equal), f"{equal.choices:,}"),
                    f"{printed[0]:.1f} ({printed[1]:.1f})" if printed else "N/A",
                    mean_and_std(best),
                    p_value(rank_sum(best.fractions, equal.fractions).p),
                ]
            )
            print(" | ".join(rows[-1]), flush=True)
    record("baselines", COLUMNS, rows)
    row("rows", str(len(rows)))
    save(options)


if __name__ == "__main__":
    main()
