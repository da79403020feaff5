"""Measure the error of a table's pose from simulated laser scans, by both methods.

Usage: python benchmarks/locating.py [--runs 100]

The table of the ITCM thesis is seen from the base poses of its Table 1, from farther away and
beside the wheelchair; each run has its own range offset and noise. Scenes without a table count how
often one is found all the same.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence

import numpy as np
from table import header, parser, record, row, save

from tcs.errors import PerceptionError
from tcs.kernel.arrays import Shapes
from tcs.model.scene import (
    EMPTY_ENVIRONMENT,
    EnvironmentFile,
    environment_shapes,
    load_environment,
)
from tcs.perception import PlanarPose, TableFile, load_table, locate
from tcs.perception.locating import METHODS
from tcs.perception.simulation import simulate, with_table

TASK = PlanarPose(0.1, 0.0, 0.0)
"""The task frame of the thesis in the frame of the table: the cup is 10 cm behind the edge (ours).
"""
# ITCM thesis, Table 1: the task in the frame of the robot, x, y [m] and rotation [deg].
SEEN = {
    "ITCM-high, 0.75 m before the task": (0.75, 0.15, 0.0),
    "Expert, 0.88 m": (0.88, 0.20, 2.9),
    "ITCM-low, 0.55 m, from the side": (0.55, -0.45, -90.0),
    "1.5 m, turned by 20 deg": (1.5, 0.15, 20.0),
    "2 m, turned by -30 deg": (2.0, 0.5, -30.0),
    "3 m, turned by 10 deg": (3.0, 0.5, 10.0),
}
BESIDE = {
    "1 m, wheelchair to the left": ((1.0, 0.15, 0.0), PlanarPose(-1.0, -1.6, 0.0)),
    "1.2 m, wheelchair between": ((1.2, -0.3, 17.0), PlanarPose(0.3, 1.3, 0.5)),
}
"""Task in the frame of the robot, and base pose in the environment of the wheelchair."""
MAHALANOBIS95 = 2.7955
"""Mahalanobis distance that 95 % of the errors of three components are below."""
POSTS = (4, 8, 16)
CHAIR = 0.04
"""Width of a post [m]."""


def main() -> None:
    """Scan, find and compare."""
    command_line = parser(__doc__)
    command_line.add_argument("--runs", type=int, default=100)
    options = command_line.parse_args()
    header()
    table = load_table("thesis")
    scenes = [(name, pose, EMPTY_ENVIRONMENT, PlanarPose(0, 0, 0)) for name, pose in SEEN.items()]
    wheelchair = load_environment("wheelchair")
    scenes += [(name, pose, wheelchair, base) for name, (pose, base) in BESIDE.items()]
    rows = []
    for name, (x, y, yaw_deg), around, base in scenes:
        pose = PlanarPose(x, y, math.radians(yaw_deg))
        for method in METHODS:
            cells = errors(table, pose, around, base, method, options.runs)
            rows.append([name, method, *cells])
            row(f"{name}, {method}", " | ".join(cells))
    columns = ["scene", "method", "found", "position error [mm]", "heading error [deg]",
               "errors within the 95 % region", "processor time"]  # fmt: skip
    record("errors", columns, rows)
    record("false", ["scene without a table", "tables found"], list(falsely(table, options.runs)))
    save(options)


def errors(
    table: TableFile, pose: PlanarPose, around: EnvironmentFile, base: PlanarPose, method: str,
    runs: int,
) -> tuple[str, ...]:  # fmt: skip
    """Return the errors of the task frame over runs, as cells."""
    scene = environment_shapes(with_table(around, table, base @ pose @ TASK.inverse()))
    found, seconds = [], []
    for run in range(runs):
        scans = simulate(scene, base, run=run)
        begun = time.process_time()
        try:
            located = locate(scans, table, method=method).shifted(TASK)
        except PerceptionError:
            continue
        finally:
            seconds.append(time.process_time() - begun)
        found.append(located.error(pose))
    if not found:
        return f"0 of {runs}", "–", "–", "–", f"{1e3 * statistics.median(seconds):.0f} ms"
    position = 1e3 * np.array([error["position"] for error in found])
    yaw = np.abs([error["yaw_deg"] for error in found])
    inside = np.mean([error["mahalanobis"] <= MAHALANOBIS95 for error in found])
    return (
        f"{len(found)} of {runs}",
        f"{position.mean():.1f} (95 % below {np.quantile(position, 0.95):.1f})",
        f"{yaw.mean():.2f} (95 % below {np.quantile(yaw, 0.95):.2f})",
        f"{100 * inside:.0f} %",
        f"{1e3 * statistics.median(seconds):.0f} ms",
    )


def falsely(table: TableFile, runs: int) -> Sequence[tuple[str, str]]:
    """Return how often a table is found where there is none."""
    rng = np.random.default_rng(0)
    wheelchair = environment_shapes(load_environment("wheelchair"))
    counts = {"wheelchair, from all sides": 0, **{f"{n} posts at random": 0 for n in POSTS}}
    for run in range(runs):
        angle = rng.uniform(-math.pi, math.pi)
        around = PlanarPose(0.5 + 1.6 * math.cos(angle), 1.6 * math.sin(angle), angle + math.pi)
        counts["wheelchair, from all sides"] += is_found(table, wheelchair, around, run)
        for n in POSTS:
            scene = posts(rng.uniform(-2.5, 2.5, (n, 2)))
            counts[f"{n} posts at random"] += is_found(table, scene, PlanarPose(0, 0, 0), run)
    cells = [(name, f"{count} of {runs}") for name, count in counts.items()]
    for name, text in cells:
        row(name, text)
    return cells


def is_found(table: TableFile, scene: Shapes, base: PlanarPose, run: int) -> bool:
    """Return whether scans of a scene are taken for a table."""
    try:
        locate(simulate(scene, base, run=run), table)
    except PerceptionError:
        return False
    return True


def posts(at: np.ndarray) -> Shapes:
    """Return square posts as wide as the legs of a chair."""
    boxes = [
        {"name": f"post {i}", "box": (CHAIR, CHAIR, 0.45), "xyz": (x, y, 0.225)}
        for i, (x, y) in enumerate(at.tolist())
    ]
    content = {**EMPTY_ENVIRONMENT.model_dump(), "obstacles": boxes}
    return environment_shapes(EnvironmentFile.model_validate(content))


if __name__ == "__main__":
    main()
