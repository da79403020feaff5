"""Re-check scores of drawn people in drawn postures with Drake.

Usage: python benchmarks/people.py [--bodies 20] [--pairs 100] [--seed 0] [--jobs 2]

Half of the people sit in the wheelchair and are shaved, half lie on the bed and are bathed, on
grids of some hundred base poses.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import yaml
from table import cell, header, parser, row, save

import tcs
from tcs.model.people import draw_bodies

GRIDS = {
    "wheelchair": {
        "base_x": {"unit": "m", "start": 0.5, "step": 0.1, "count": 8},
        "base_y": {"unit": "m", "start": -0.95, "step": 1.7, "count": 2},
        "base_yaw": {"unit": "deg", "start": 90, "step": 45, "count": 4},
        "torso": {"unit": "m", "start": 0.15, "step": 0.15, "count": 2},
    },
    "bed": {
        "bed_height": {"unit": "m", "start": 0.1, "step": 0.1, "count": 1},
        "head_rest": {"unit": "deg", "start": 35, "step": 35, "count": 2},
        "base_x": {"unit": "m", "start": 0.3, "step": 0.3, "count": 4},
        "base_y": {"unit": "m", "start": -0.8, "step": 1.6, "count": 2},
        "base_yaw": {"unit": "deg", "start": 0, "step": 90, "count": 4},
        "torso": {"unit": "m", "start": 0.15, "step": 0.15, "count": 2},
    },
}
ROWS = (("shaving", "wheelchair"), ("bathing", "bed"))
ANGLES = {
    "head_turn": (-58.0, 58.0),
    "head_tilt": (-18.0, 18.0),
    "head_lean": (-20.0, 20.0),
    **{
        f"{joint}_{side}": ends
        for side in ("left", "right")
        for joint, ends in (
            ("shoulder_flexion", (0.0, 60.0)),
            ("shoulder_abduction", (0.0, 60.0)),
            ("elbow_flexion", (5.0, 100.0)),
        )
    },
}
"""Least and greatest angle of each joint that is drawn [deg]."""


def main() -> None:
    """Score and re-check each person, print and record the sums."""
    command_line = parser(__doc__)
    command_line.add_argument("--bodies", type=int, default=20)
    command_line.add_argument("--pairs", type=int, default=100)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    people = draw_bodies(options.bodies, seed=options.seed)
    generator = np.random.default_rng(options.seed)
    counts = {row_of: np.zeros(3, dtype=np.int64) for row_of in ROWS}
    for number in range(options.bodies):
        # Women and men alternate, so that both sit and both lie.
        task, environment = row_of = ROWS[number // 2 % 2]
        drawn = {joint: float(generator.uniform(*ends)) for joint, ends in ANGLES.items()}
        angles = {f"{joint}_deg": angle for joint, angle in drawn.items()}
        body = people[number]
        with tempfile.TemporaryDirectory() as folder:
            path = on_small_grid(Path(folder), environment)
            person = {"sex": body.sex, **body.measures, **angles}
            file = tcs.score(task, path, person=person, jobs=options.jobs, paper=True)
            found = tcs.verify(file, pairs=options.pairs, dense=0, jobs=options.jobs)
        counts[row_of] += (1, found.checked, found.false_reached)
        row(
            f"{task}, person {number}",
            f"{body.sex}, {body.stature:.3f} m, head turn {drawn['head_turn']:+.0f} deg: "
            f"{found.false_reached} false of {found.checked}",
        )
    for (task, environment), (bodies, checked, false) in counts.items():
        line = f"{task} / {environment}"
        cell("verified", line, "people", str(bodies))
        cell("verified", line, "reached pairs re-checked", f"{checked:,}")
        cell("verified", line, "false", str(false))
    save(options)


def on_small_grid(folder: Path, name: str) -> Path:
    """Write an environment on a small grid."""
    content = {
        "name": f"small-{name}",
        "based_on": name,
        "grid": GRIDS[name],
        "observed": {},
    }
    path = folder / f"small-{name}.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


if __name__ == "__main__":
    main()
