"""An arm of five joints with a sixth one behind the tool, about the axis that goals leave free."""

from __future__ import annotations

import numpy as np

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.six_joints.arm import SixJointArm, six_joint_arm


def turned_chain(chain: Chain, axis: FloatArray) -> Chain:
    """Return an arm of six joints: the arm of five, then a rotation of the tool about an axis.

    Its joints 2 to 6 are the joints 3 to 7 of `chain`. Its tool at X_AG, with the last joint at w,
    is the tool of the arm of five at X_AG Rot(axis, -w).

    Args:
        chain: An arm of five joints.
        axis: Unit vector in the tool frame, shape (3,).
    """
    # L1 to L3 are about the same axis, that of the arm's first joint; one of them is left out.
    R, p = np.delete(chain.R, 1, axis=0), np.delete(chain.p, 1, axis=0)
    R_TV = _with_z_along(axis)
    R = np.concatenate([R[:6], [R[6] @ R_TV], [R_TV.T]])
    return Chain(
        R=np.ascontiguousarray(R),
        p=np.ascontiguousarray(np.concatenate([p, np.zeros((1, 3))])),
        lower=np.append(chain.lower[1:], -np.inf),
        upper=np.append(chain.upper[1:], np.inf),
        joints=6,
        slides=np.append(chain.slides[1:], 0.0),
    )


def turned_arm(chain: Chain, axis: FloatArray) -> SixJointArm:
    """Return the constants that solve an arm of five joints for goals free about an axis.

    Args:
        chain: An arm of five joints.
        axis: Unit vector in the tool frame, shape (3,).

    Raises:
        ArmClassError: If the rotation about the axis adds nothing to what the joints can do, as
            about the axis of the last joint, or prismatic joints leave it without a closed form.
    """
    try:
        return six_joint_arm(turned_chain(chain, axis))
    except ArmClassError as error:
        if np.any(chain.slides):
            raise ArmClassError(
                f"with the tool's free rotation as the sixth joint, {error}"
            ) from None
        raise ArmClassError(
            "the free rotation adds nothing to what the five joints can do, or cannot be told from "
            "them, as one about the axis of the last joint: goals must leave another axis free."
        ) from None


def _with_z_along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose z axis is the unit vector `axis`, shape (3, 3)."""
    aside = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    aside = aside / np.linalg.norm(aside)
    return np.stack([aside, np.cross(axis, aside), axis], axis=1)
