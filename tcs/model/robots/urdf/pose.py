"""Forward kinematics of a URDF without Drake."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.model.robots.urdf.model import Urdf

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
        R = R @ Rotation.from_euler("xyz", joint.rpy).as_matrix()
        if not joint.is_movable:
            continue
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        q = positions.get(joint.name, 0.0)
        if joint.type == "prismatic":
            p = p + R @ axis * q
        else:
            R = R @ Rotation.from_rotvec(axis * q).as_matrix()
    return R, p
