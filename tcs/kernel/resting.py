"""The arm in its rest postures, placed in the base frame."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import SPHERE, Chain, FloatArray, IntArray, SceneArrays
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, SIZE, TYPE, pack
from tcs.kernel.shape_groups import ShapeGroups, with_boxes


def resting_arm(
    scene: SceneArrays, order: IntArray, groups: ShapeGroups
) -> tuple[FloatArray, FloatArray]:
    """Return the arm's shapes in B in its rest postures, and a bounding sphere of all, packed.

    Args:
        scene: The scene.
        order: Order of the arm's shapes.
        groups: Groups of the shapes in this order; the boxes around them follow the shapes.

    Returns:
        Shapes (torso levels, postures, arm rows, 17) and (torso levels, postures, 17).
    """
    levels, postures, frame = len(scene.arm_base_p), len(scene.rest), scene.arm.frame
    if not postures or not len(frame):
        rows = len(order) + len(groups.in_boxes())
        return np.zeros((levels, 0, rows, COLUMNS)), np.zeros((levels, 0, COLUMNS))
    R, p = [], []
    for R_BA, p_BA in zip(scene.arm_base_R, scene.arm_base_p, strict=True):
        for q in scene.rest:
            R_AL, p_AL = _link_poses(scene.chain, q)
            R_BL, p_BL = R_BA @ R_AL[frame], p_AL[frame] @ R_BA.T + p_BA
            R.append(R_BL @ scene.arm.R[0])
            p.append(np.einsum("nij,nj->ni", R_BL, scene.arm.p[0]) + p_BL)
    placed = with_boxes(pack(scene.arm._replace(R=np.array(R), p=np.array(p)), order), groups)
    shape = (levels, postures)
    return placed.reshape(*shape, *placed.shape[1:]), _spheres(placed).reshape(*shape, COLUMNS)


def _link_poses(chain: Chain, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the poses in A of A, L1 .. L7 and the coupled links at joint angles q [rad]."""
    R, p = [np.eye(3)], [np.zeros(3)]
    for i in range(7):
        moved, sliding = np.eye(3), chain.slides[i] * q[i]
        if not chain.slides[i]:
            c, s = np.cos(q[i]), np.sin(q[i])
            moved[:2, :2] = [[c, -s], [s, c]]
        turned = R[i] @ chain.R[i]
        R.append(turned @ moved)
        p.append(p[i] + R[i] @ chain.p[i] + sliding * turned[:, 2])
    for joint, fraction in chain.coupled:
        i = int(joint)
        R.append(R[i + 1])
        p.append(p[i + 1] - (1.0 - fraction) * chain.slides[i] * q[i] * R[i + 1][:, 2])
    return np.array(R), np.array(p)


def _spheres(rows: FloatArray) -> FloatArray:
    """Return a sphere around the packed shapes of each state, packed, shape (states, 17)."""
    centres, radii = rows[..., CENTRE : CENTRE + 3], rows[..., BOUND, None]
    middle = ((centres - radii).min(axis=1) + (centres + radii).max(axis=1)) / 2
    out = np.linalg.norm(centres - middle[:, None], axis=2) + rows[..., BOUND]
    spheres = np.zeros((len(rows), COLUMNS))
    spheres[:, TYPE], spheres[:, CENTRE : CENTRE + 3] = SPHERE, middle
    spheres[:, BOUND] = spheres[:, SIZE] = out.max(axis=1)
    return spheres
