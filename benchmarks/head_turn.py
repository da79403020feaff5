"""Measure what it gains that the person in the wheelchair can turn the head, for the face tasks.

Usage: python benchmarks/head_turn.py [--jobs 2]
"""

from __future__ import annotations

from table import CHECKOUT, header, parser, record, row, save

import tcs
from tcs.output.words import member_text, percentage
from tcs.placement.tables import ScoreTable, SetTable

TASKS = ("shaving", "feeding", "brushing")
STRAIGHT = "wheelchair"
TURNING = CHECKOUT / "examples" / "wheelchair_head_turn.yaml"
COLUMNS = (
    "best single, goals",
    "best single, P_M",
    "best set, goals",
    "best set, P_M",
    "configurations that reach all goals",
)


def main() -> None:
    """Score each task with the head straight and turned, print and record the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    gain, best = [], []
    for task in TASKS:
        for name, environment in (("straight", STRAIGHT), ("turned", TURNING)):
            file = tcs.score(task, environment, "pr2", jobs=options.jobs, paper=True)
            gain.append([task, name, *cells(file.nominal.scores, file.nominal.sets)])
            row(f"{task}, {name}", "  ".join(gain[-1][2:]))
        sets = file.nominal.sets
        members = (file.configurations.configuration(h).to_json() for h in sets.best_single)
        best.append([task, "; ".join(map(member_text, members))])
    record("gain", ["task", "head", *COLUMNS], gain)
    record("best", ["task", "best single configuration with the head turned"], best)
    save(options)


def cells(scores: ScoreTable, sets: SetTable) -> list[str]:
    """Return the scores of the best single configuration and of the best set."""
    single, best = sets.scores_of(sets.best_single), sets.scores_of(sets.best)
    reached = scores.reached
    return [
        *(percentage(single[0]), f"{single[1]:.3f}"),
        *(percentage(best[0]), f"{best[1]:.3f}"),
        f"{int(reached.all(axis=1).sum()):,} of {len(reached):,}",
    ]


if __name__ == "__main__":
    main()
