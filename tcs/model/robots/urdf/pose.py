"""Forward kinematics of a URDF without Drake."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.model.robots.urdf.model import Urdf, Vector

FloatArray = NDArray[np.float64]


def pose_in_root(
    model: Urdf, body: str, positions: Mapping[str, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the pose of a body B in the root link A: R_AB of shape (3, 3) and p_AoBo_A [m].

    Args:
        model: The robot.
        body: Name of the body.
        positions: Positions of the joints from root to body [rad or m]; 0 for those left out.
    """
    chain = model.chain(model.root, body)
    assert chain is not None
    R, p = np.eye(3), np.zeros(3)
    for joint in chain:
        p = p + R @ np.array(joint.xyz)
        R = R @ _rotation_of_rpy(joint.rpy)
        if not joint.is_movable:
            continue
        axis = _direction(joint.axis)
        q = positions.get(joint.name, 0.0)
        if joint.type == "prismatic":
            p = p + R @ np.array(axis) * q
        else:
            R = R @ _rotation_about(axis, q)
    return R, p


@cache
def _rotation_of_rpy(rpy: Vector) -> FloatArray:
    """Return the rotation matrix of roll, pitch, yaw about fixed axes [rad]."""
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    R.setflags(write=False)
    return np.asarray(R)


@cache
def _direction(axis: Vector) -> Vector:
    """Return an axis at length 1."""
    length = math.hypot(*axis)
    x, y, z = (a / length for a in axis)
    return x, y, z


def _rotation_about(axis: Vector, angle: float) -> FloatArray:
    """Return the rotation matrix about an axis of length 1 [rad]."""
    # SciPy's takes ten times as long.
    x, y, z = axis
    c, s = math.cos(angle), math.sin(angle)
    t = 1.0 - c
    return np.array(
        [
            [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
            [t * x * y + s * z, c + t * y * y, t * y * z - s * x],
            [t * x * z - s * y, t * y * z + s * x, c + t * z * z],
        ]
    )
