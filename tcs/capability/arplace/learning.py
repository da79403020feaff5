"""Learning: labels from the kernel, boundaries from them, and the generalised success model."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from tcs.capability.arplace.boundary import Classifier, region_of
from tcs.capability.arplace.labels import label
from tcs.capability.arplace.model import Arplace
from tcs.capability.arplace.region_vectors import (
    AUTOMATIC,
    BY_SHAPE,
    EQUIDISTANT,
    SIGNED_DISTANCE,
    chosen,
    shape_vectors,
)
from tcs.capability.arplace.success_model import INTERPOLATED, QUADRATIC
from tcs.capability.arplace.task import TableTask
from tcs.capability.reach import OnProgress
from tcs.errors import SelectionError
from tcs.files.paths import data_reference
from tcs.kernel.arrays import BoolArray
from tcs.model.robots import load_robot

_ENERGY = {BY_SHAPE: 0.99, EQUIDISTANT: 0.99, SIGNED_DISTANCE: 0.999}
"""Fraction of the variance that is kept by default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelOptions:
    """How labels are generalised."""

    representation: str = AUTOMATIC
    """One of `REPRESENTATIONS`, or `AUTOMATIC`."""
    rule: str = AUTOMATIC
    """One of `tcs.capability.arplace.success_model.RULES`; `AUTOMATIC` is quadratic for landmarks
    and interpolated for signed distances."""
    energy: float | None = None
    """Fraction of the variance that its modes hold; None is 0.99 for landmarks and 0.999 for signed
    distances, most of whose variance is far from the boundary."""
    classifier: Classifier = field(default_factory=Classifier)
    """Parameters of the support vector machine."""


def learn(
    robot: str | Path,
    task: TableTask | None = None,
    options: ModelOptions | None = None,
    *,
    jobs: int = 2,
    on_progress: OnProgress | None = None,
) -> Arplace:
    """Return the ARPlace of a robot for a task.

    Args:
        robot: Name of a robot that ships with tcs, or path of a robot file.
        task: Grasps and base positions; None is the default `TableTask`.
        options: How labels are generalised.
        jobs: Number of threads; the result does not depend on it.
        on_progress: Called with the number of labels done and of all.

    Raises:
        TcsError: If scikit-learn is not installed, or an option is out of range.
        UnknownNameError: If there is no such robot.
        RobotError: If the robot cannot be used.
        GridError: If the torso height is out of range.
        SelectionError: If no base position reaches any grasp, or the regions cannot be represented
            by landmarks.
    """
    task = task or TableTask()
    file = load_robot(robot)
    found = label(file, task, jobs=jobs, on_progress=on_progress)
    return generalised(
        task,
        found.reached,
        options or ModelOptions(),
        torso_height=found.torso_height,
        base_radius=found.base_radius,
        metadata={
            "robot": data_reference(robot, file.name),
            "tool": file.tool_frame,
            "scene_digest": found.scene_digest,
        },
    )


def generalised(
    task: TableTask, reached: BoolArray, options: ModelOptions, *, torso_height: float = 0.0,
    base_radius: float = 0.0, metadata: dict[str, Any] | None = None,
) -> Arplace:  # fmt: skip
    """Return the ARPlace of given labels.

    Args:
        task: Grasps and base positions.
        reached: Labels, shape (grasps, x, y).
        options: How they are generalised.
        torso_height: Torso height [m].
        base_radius: Radius of the base [m].
        metadata: Further metadata.

    Raises:
        TcsError: If scikit-learn is not installed, or an option is out of range.
        SelectionError: If no label is true, or the regions cannot be represented by landmarks.
    """
    if not reached.any():
        raise SelectionError(
            "no base position reaches any grasp. Check heights, angles, torso height and table."
        )
    x, y = task.base_x.values, task.base_y.values
    regions = [region_of(x, y, grasp, options.classifier) for grasp in reached]
    representation = chosen(options.representation, regions)
    vectors, used = shape_vectors(representation, regions)
    rule = options.rule
    if rule == AUTOMATIC:
        rule = INTERPOLATED if representation == SIGNED_DISTANCE else QUADRATIC
    return Arplace(
        task=task,
        reached=reached,
        boundaries=tuple(region.boundary for region in regions),
        representation=representation,
        vectors=np.asarray(vectors, dtype=np.float64),
        used=used,
        rule=rule,
        energy=_ENERGY[representation] if options.energy is None else options.energy,
        torso_height=torso_height,
        base_radius=base_radius,
        metadata={
            "classifier": asdict(options.classifier),
            "program_version": version("tcs"),
            **(metadata or {}),
        },
    )
