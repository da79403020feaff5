"""Simulated scans: rays against the shapes of a scene, with the errors of the scanner."""

from __future__ import annotations

import numpy as np

from tcs.errors import EnvironmentFileError
from tcs.files.documents import checked
from tcs.kernel.arrays import FloatArray, Shapes
from tcs.model.random_streams import check_draws, named_generator
from tcs.model.scene import EnvironmentFile
from tcs.perception.planar_pose import PlanarPose
from tcs.perception.rays import cast
from tcs.perception.scanner import TIAGO, LaserScanner
from tcs.perception.scans import Scans
from tcs.perception.table_file import TableFile


def with_table(
    environment: EnvironmentFile, table: TableFile | None, pose: PlanarPose
) -> EnvironmentFile:
    """Return an environment with a table in it.

    Args:
        environment: The environment.
        table: The table; None adds nothing.
        pose: X_WF, the pose of the table.

    Raises:
        EnvironmentFileError: If a name of a part of the table is taken.
    """
    if table is None:
        return environment
    obstacles = (*environment.model_dump()["obstacles"], *table.boxes(pose))
    content = {**environment.model_dump(), "obstacles": obstacles}
    where = f"environment '{environment.name}' with table '{table.name}'"
    return checked(content, EnvironmentFile, where, EnvironmentFileError)


def true_ranges(shapes: Shapes, scanner: LaserScanner, base: PlanarPose) -> FloatArray:
    """Return the distance along each beam to the nearest shape [m], shape (beams,).

    Args:
        shapes: Shapes in W.
        scanner: The scanner.
        base: X_WB, the pose of the base.
    """
    at = base @ scanner.pose
    directions = np.column_stack([scanner.directions @ at.R.T, np.zeros(scanner.beams)])
    return cast(np.array([at.x, at.y, scanner.height]), directions, shapes)


def simulate(
    shapes: Shapes,
    base: PlanarPose,
    *,
    scanner: LaserScanner = TIAGO,
    scans: int = 10,
    seed: int = 0,
    run: int = 0,
) -> Scans:
    """Return scans of a scene; the robot itself is not in view.

    The same seed and run have the same errors, whatever is scanned.

    Args:
        shapes: Shapes in W, e.g. of `tcs.model.scene.environment.shapes`.
        base: X_WB, the pose of the base.
        scanner: The scanner.
        scans: Number of scans.
        seed: Seed of the random numbers.
        run: Number of the run, each with its own offset.

    Raises:
        TcsError: If the number of scans or the seed is out of range.
    """
    check_draws(scans, seed)
    ranges = true_ranges(shapes, scanner, base)
    random = named_generator(seed, f"laser scan {run}")
    offset = scanner.offset * random.standard_normal()
    noise = random.standard_normal((scans, scanner.beams))
    measured = np.isfinite(ranges)
    distance = np.where(measured, ranges, scanner.farthest)
    noisy = distance + offset + scanner.deviation(distance) * noise
    # A beam that meets something out of range, or nothing, returns nothing.
    in_range = measured & (ranges <= scanner.farthest) & (ranges >= scanner.nearest)
    return Scans(scanner, np.where(in_range, noisy, np.inf))
