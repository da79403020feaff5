"""Measure what it gains that joints of the person may be chosen, and whom a posture lets be served.

Usage: python benchmarks/postures.py [--bodies 1000] [--seed 0] [--jobs 2]

The head takes turns and tilts of TOC's head; on the bed the arms are lifted away from the trunk.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import yaml
from head_turn import COLUMNS, cells
from table import header, parser, record, row, save

import tcs
from tcs.model.people import draw_bodies
from tcs.model.scene import load_environment
from tcs.output.words import goal_text, member_text, percentage

HEAD = {"head_turn": (-58.0, 58.0, 3), "head_tilt": (-18.0, 18.0, 3)}
"""First and last angle of each axis [deg], and their number."""
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
        for name, chosen in (("as in the papers", {}), ("chosen", axes)):
            file = scored(task, environment, chosen, options.jobs)
            gain.append([f"{task} / {environment}", name, *cells(file)])
            row(f"{task} / {environment}, {name}", "  ".join(gain[-1][2:]))
        sets = file.nominal.sets
        members = (file.configurations.configuration(h).to_json() for h in sets.best_single)
        best.append([f"{task} / {environment}", "; ".join(map(member_text, members))])
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
        return tcs.score(task, path, "pr2", jobs=jobs)


def served_cells(posture: str | None, options: argparse.Namespace) -> list[str]:
    """Return whom the best set of bathing in bed serves, of people in a posture."""
    person = None if posture is None else {"posture": posture}
    file = tcs.score("bathing", "bed", "pr2", person=person, jobs=options.jobs)
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
