"""Compare the left arm, the right arm, and sets whose members use either arm of the PR2.

Usage: python benchmarks/arms.py [--jobs 2]

Each task is scored, on the bed with the person at the nominal position, with `pr2` and with
`pr2_right`. A member of a set is a configuration with an arm: at one base pose the robot may use
one arm after the other, the other one being in its rest posture. Base positions of two members are
the same or at least 0.40 m apart, the least distance of stored sets. All sets are compared by
P_R + P_M, without error.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from printed_grid import at_nominal_position
from table import header, parser, record, row, save

import tcs
from tcs.model.grid import Grid
from tcs.placement.store import ScoreFile
from tcs.placement.tables import ScoreTable, tc_manipulability, tc_reachability

ROWS = (
    *(("shaving", "wheelchair"), ("feeding", "wheelchair"), ("brushing", "wheelchair")),
    *(("shaving", "bed"), ("bathing", "bed")),
)
ROBOTS = ("pr2", "pr2_right")
LEAST_DISTANCE = 0.40
CHUNK = 500
"""First members whose pairs are formed together: some 100 MB."""
FloatArray = NDArray[np.float64]


def main() -> None:
    """Score every task with both arms and print the best sets."""
    command_line = parser(__doc__)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    columns = [
        *("task, environment", "one base pose: left", "right", "either", "both arms"),
        *("two base poses: left", "right", "either, another at each"),
    ]
    rows = []
    print(" | ".join(columns))
    with tempfile.TemporaryDirectory() as folder:
        for task, environment in ROWS:
            nominal: str | Path = environment
            if environment == "bed":
                nominal = at_nominal_position(environment, Path(folder))
            files = [
                tcs.score(task, nominal, robot, jobs=options.jobs, paper=True) for robot in ROBOTS
            ]
            rows.append([f"{task}, {environment}", *compared(*files)])
            print(" | ".join(rows[-1]), flush=True)
    record("arms", columns, rows)
    row("rows", str(len(rows)))
    save(options)


def compared(left: ScoreFile, right: ScoreFile) -> list[str]:
    """Return P_R and P_M of the best sets, in the order of the columns."""
    one, other = left.nominal.scores, right.nominal.scores
    of_one = [best_of(arm.reached, arm.dexterity, arm.weights) for arm in (one, other)]
    together = best_of(
        one.reached | other.reached, np.maximum(one.dexterity, other.dexterity), one.weights
    )
    of_two = [file.nominal.sets.scores_of(file.nominal.sets.best) for file in (left, right)]
    across = max(*of_two, best_across(left, right), key=sum)
    found = (*of_one, max(of_one, key=sum), together, *of_two, across)
    return [f"{100 * reached:.0f} %, {dexterity:.3f}" for reached, dexterity in found]


def best_of(
    reached: NDArray[np.bool_], dexterity: NDArray[np.float32], weights: FloatArray
) -> tuple[float, float]:
    """Return P_R and P_M of the best configuration by their sum."""
    both = tc_reachability(reached, weights), tc_manipulability(dexterity, weights)
    best = int(np.argmax(both[0] + both[1]))
    return float(both[0][best]), float(both[1][best])


def best_across(left: ScoreFile, right: ScoreFile) -> tuple[float, float]:
    """Return P_R and P_M of the best pair of a left-arm and a right-arm configuration."""
    one, other = (reaching(file) for file in (left, right))
    weights = left.nominal.sets.weights
    best = (0.0, 0.0)
    for begin in range(0, len(one[0]), CHUNK):
        part = slice(begin, begin + CHUNK)
        apart = np.linalg.norm(one[0][part, None] - other[0][None], axis=2)
        reachability = np.zeros(apart.shape)
        manipulability = np.zeros(apart.shape)
        for g, weight in enumerate(weights.tolist()):
            reachability += weight * (one[1][part, g][:, None] | other[1][:, g])
            manipulability += weight * np.maximum(one[2][part, g][:, None], other[2][:, g])
        total = reachability + manipulability
        total[(apart < LEAST_DISTANCE - 1e-9) & (apart > 1e-9)] = 0.0
        at = np.unravel_index(int(np.argmax(total)), total.shape)
        best = max(best, (float(reachability[at]), float(manipulability[at])), key=sum)
    return best


def reaching(
    file: ScoreFile,
) -> tuple[FloatArray, NDArray[np.bool_], NDArray[np.float32]]:
    """Return base positions (n, 2) [m], reached goals and dexterity where a goal is reached."""
    table: ScoreTable = file.nominal.scores
    rows = np.flatnonzero(table.reached.any(axis=1))
    at = Grid.from_dict(file.grid).values(rows)
    xy = np.stack([at["base_x"], at["base_y"]], axis=1)
    return xy, table.reached[rows], table.dexterity[rows]


if __name__ == "__main__":
    main()
