"""Positions of the environment's joints under error, which their limits bound."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.model.scene import Scene
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.scoring.job import Job


def displaced(
    job: Job, scene: Scene, nominal: Mapping[str, float], offsets: Offsets
) -> tuple[dict[str, FloatArray], NDArray[np.bool_]]:
    """Return joint positions in each sample, and whether a joint was held at its limit.

    Args:
        job: Robot and environment.
        scene: Its live scene.
        nominal: Positions without error, by joint [m or rad]; other joints are where the
            environment file has them.
        offsets: Errors of the joints, shapes (samples,).
    """
    samples = samples_of(offsets)
    positions = {name: np.full(samples, value) for name, value in nominal.items()}
    limited = np.zeros(samples, dtype=np.bool_)
    for name, error in offsets.items():
        center = nominal.get(name, scene.built.environment_joints.default(name))
        lower, upper = scene.built.environment_joints.limits(name)
        # Rounding may put the last grid value beyond the limit, where it must remain.
        moved = center + np.asarray(error, dtype=np.float64)
        positions[name] = np.clip(moved, min(lower, center), max(upper, center))
        limited |= positions[name] != moved
    return positions, limited


def samples_of(offsets: Offsets) -> int:
    """Return the number of samples.

    Raises:
        TcsError: If the joints have different numbers of samples, or there is no joint.
    """
    sizes = {len(values) for values in offsets.values()}
    if len(sizes) != 1:
        raise TcsError(
            "Errors must be given for at least one joint, with the same number of samples for each."
        )
    return sizes.pop()
