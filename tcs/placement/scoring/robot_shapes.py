"""The robot's collision shapes, taken from the arrays that were scored."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, SceneArrays, Shapes
from tcs.placement.store.robot_shapes import Primitives, RobotShapes

MAX_SHAPES = 2000
"""Most shapes that are stored: twenty times those of the largest robot that ships."""

SAME = 1e-9
"""Greatest difference [m] between a shape and its place under a torso that only translates."""


def robot_shapes(arrays: SceneArrays) -> RobotShapes | None:
    """Return the robot's shapes, or None if there are too many or the torso does not translate.

    Args:
        arrays: The lowered scene.
    """
    if len(arrays.arm.type) + len(arrays.body.type) > MAX_SHAPES:
        return None
    torso_shift = _torso_shift(arrays)
    if torso_shift is None:
        return None
    return RobotShapes(
        chain_R=arrays.chain.R,
        chain_p=arrays.chain.p,
        arm_base_R=arrays.arm_base_R[0],
        arm_base_p=arrays.arm_base_p[0],
        torso_shift=torso_shift,
        arm=_primitives(arrays.arm),
        body=_primitives(arrays.body),
        margin=float(arrays.margin),
        slides=arrays.chain.slides,
        coupled=arrays.chain.coupled,
        rest=arrays.rest,
    )


def _torso_shift(arrays: SceneArrays) -> FloatArray | None:
    """Return the displacement of the torso at each level, shape (levels, 3), if it translates."""
    torso_shift: FloatArray = arrays.arm_base_p - arrays.arm_base_p[0]
    moved = arrays.body.p[0] + (arrays.body.frame == 1)[None, :, None] * torso_shift[:, None]
    same = (
        np.allclose(moved, arrays.body.p, rtol=0.0, atol=SAME)
        and np.allclose(arrays.body.R, arrays.body.R[0], rtol=0.0, atol=SAME)
        and np.allclose(arrays.arm_base_R, arrays.arm_base_R[0], rtol=0.0, atol=SAME)
    )
    return torso_shift if same else None


def _primitives(shapes: Shapes) -> Primitives:
    return Primitives(
        type=shapes.type.astype(np.int64),
        size=shapes.size,
        pad=shapes.pad,
        frame=shapes.frame.astype(np.int64),
        R=shapes.R[0],
        p=shapes.p[0],
    )
