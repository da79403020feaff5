"""Measure what it gains that joints of the person may be chosen, and whom a posture lets be served.

Usage: python benchmarks/postures.py [--bodies 1000] [--seed 0] [--jobs 2]

The head takes turns and tilts of TOC's head; on the bed the arms are lifted away from the trunk. As
in TOC the head may also take another of its seven poses for each goal.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from head_turn import COLUMNS, cells
from table import header, parser, record, row, save

import tcs
from tcs.model.people import draw_bodies
from tcs.model.scene import load_environment
from tcs.output.words import goal_text, member_text, percentage
from tcs.placement.scoring.sets import build_sets
from tcs.placement.tables import ScoreTable, SetTable

HEAD = {"head_turn": (-58.0, 58.0, 3), "head_tilt": (-18.0, 18.0, 3)}
"""First and last angle of each axis [deg], and their number."""
TOC_POSES = ((58, 18), (58, 0), (58, -18), (0, 0), (-58, 18), (-58, 0), (-58, -18))
"""Turn and tilt of the head in TOC [deg], from the program that its authors published."""
ARMS = {"shoulder_abduction_left": (0.0, 40.0, 3), "shoulder_abduction_right": (0.0, 40.0, 3)}
ROWS = (
    ("shaving", "wheelchair", HEAD),
    ("feeding", "wheelchair", HEAD),
    ("brushing", "wheelchair", HEAD),
    ("shaving", "bed", HEAD),
    ("shaving", "bed-no-wall", HEAD),
    ("bathing", "bed", ARMS),
)
"""Tasks on the face, and the one other task that no single configuration does."""
POSTURES = (None, "arms_apart")
"""Postures in which people are bathed."""


def main() -> None:
    """Score each row without and with the axes, count the people served, record the tables."""
    command_line = parser(__doc__)
    command_line.add_argument("--bodies", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    gain, best = [], []
    for task, environment, axes in ROWS:
        title = f"{task} / {environment}"
        plain = scored(task, environment, {}, options.jobs)
        gain.append([title, "as in the papers", *cells(plain.nominal.scores, plain.nominal.sets)])
        file = scored(task, environment, axes, options.jobs)
        gain.append([title, "chosen", *cells(file.nominal.scores, file.nominal.sets)])
        if axes == HEAD:
            posed = posed_for_each_goal(file, plain, options.jobs)
            gain.append([title, "TOC's head, posed for each goal", *cells(*posed)])
        sets = file.nominal.sets
        members = (file.configurations.configuration(h).to_json() for h in sets.best_single)
        best.append([title, "; ".join(map(member_text, members))])
        for entry in gain:
            if entry[0] == title:
                row(f"{title}, {entry[1]}", "  ".join(entry[2:]))
    record("gain", ["row", "posture", *COLUMNS], gain)
    record("best", ["row", "best single configuration with the posture chosen"], best)
    served = [served_cells(posture, options) for posture in POSTURES]
    columns = ["posture", "best set reaches", "people served", "interval", "goal most often missed"]
    record("served", columns, served)
    save(options)


def scored(
    task: str, name: str, axes: dict[str, tuple[float, float, int]], jobs: int
) -> tcs.ScoreFile:
    """Return the scores of a row with further axes, for the nominal place of the person."""
    grid = {key: dict(axis) for key, axis in load_environment(name).grid.items()}
    for joint, (first, last, count) in axes.items():
        step = (last - first) / (count - 1)
        grid[joint] = {"unit": "deg", "start": first, "step": step, "count": count}
    content = {"name": f"{name}-chosen", "based_on": name, "grid": grid, "observed": {}}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chosen.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return tcs.score(task, path, "pr2", jobs=jobs, paper=True)


def posed_for_each_goal(
    file: tcs.ScoreFile, plain: tcs.ScoreFile, jobs: int
) -> tuple[ScoreTable, SetTable]:
    """Return the scores if the head takes at each goal the best of TOC's poses.

    Args:
        file: Scores with the head's axes.
        plain: Scores of the same row without them.
        jobs: Number of threads.
    """
    scores, grid = file.nominal.scores, file.configurations
    at = grid.values(np.arange(grid.size))
    turn, tilt = (np.rint(np.degrees(at[name])) for name in HEAD)
    # Without the head's axes, configurations follow each other as on the grid of the other file.
    rows = np.array([np.flatnonzero((turn == one[0]) & (tilt == one[1])) for one in TOC_POSES])
    best = scores.dexterity[rows].argmax(axis=0)
    taken = rows[best, np.arange(plain.configurations.size)[:, None]], np.arange(best.shape[1])
    reached = scores.reached[taken]
    joints = np.cumsum(scores.reached).reshape(scores.reached.shape)[taken] - 1
    merged = replace(
        scores,
        dexterity=scores.dexterity[taken],
        reason=scores.reason[taken],
        pair=scores.pair[taken],
        arm_joints=scores.arm_joints[joints[reached]],
    )
    return merged, build_sets(merged, plain.configurations, jobs=jobs)


def served_cells(posture: str | None, options: argparse.Namespace) -> list[str]:
    """Return whom the best set of bathing in bed serves, of people in a posture."""
    person = None if posture is None else {"posture": posture}
    file = tcs.score("bathing", "bed", "pr2", person=person, jobs=options.jobs, paper=True)
    people = draw_bodies(options.bodies, seed=options.seed)
    found = tcs.population(file, people, top=tcs.Top(count=1), jobs=options.jobs).to_json()
    low, high = found["ci95"]
    missed = found["not_served"]["goals"][:1]
    text = [
        "as in the papers" if posture is None else posture.replace("_", " "),
        percentage(tcs.summary(file)["best"]["reachability"]),
        percentage(found["served"]),
        f"{percentage(low)} to {percentage(high)}",
        *(f"{goal_text(g['goal'], g['name'])}: {percentage(g['not_reached'])}" for g in missed),
    ]
    row(text[0], "  ".join(text[1:]))
    return text


if __name__ == "__main__":
    main()
