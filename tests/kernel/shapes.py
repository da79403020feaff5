"""Random shapes and chains that several kernel tests share."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, Chain, Shapes
from tests.reference.kinematics import PlacedShape


def rotation(rng):
    """Return a uniformly random rotation matrix."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def about(axis, angle):
    """Return the rotation by `angle` about `axis` (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * (K @ K)


def right_angles(rng):
    """Return one of the 24 rotations that map axes onto axes."""
    columns = np.eye(3)[:, rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
    return columns if np.linalg.det(columns) > 0 else -columns


def placed(shape_type, size, R=None, p=(0.0, 0.0, 0.0), pad=0.0, body=0):
    """Return one shape at one pose."""
    R = np.eye(3) if R is None else R
    return PlacedShape(
        shape_type, np.asarray(size, float), np.asarray(R), np.asarray(p, float), pad, body
    )


def random_size(rng, shape_type):
    """Return sizes between a thin plate or a needle and a big block."""
    if shape_type == SPHERE:
        return np.array([10 ** rng.uniform(-2.3, -0.5), 0.0, 0.0])
    if shape_type == CAPSULE:
        return np.array([10 ** rng.uniform(-2.3, -0.7), 10 ** rng.uniform(-2.3, 0.3), 0.0])
    return 10 ** rng.uniform(-3.0, 0.3, 3)


def as_shapes(items, frame=0):
    """Return placed shapes as `Shapes` in one state."""
    n = len(items)
    return Shapes(
        type=np.array([item.type for item in items], np.int8),
        size=np.array([item.size for item in items], float).reshape(n, 3),
        pad=np.array([item.pad for item in items], float),
        body=np.array([item.body for item in items], np.int16),
        frame=np.full(n, frame, np.int8),
        R=np.array([item.R for item in items], float).reshape(1, n, 3, 3),
        p=np.array([item.p for item in items], float).reshape(1, n, 3),
    )


def random_arm(rng, *, spherical_shoulder=False):
    """Return a random arm of the closed-form class: any twists, any other offsets.

    Args:
        rng: Random numbers.
        spherical_shoulder: Whether axes 1, 2 and 3 meet, and 5 and 6, instead of 2 and 3,
            and 5, 6 and 7.
    """
    R = np.array([rotation(rng) for _ in range(8)])
    p = rng.uniform(-0.3, 0.3, (8, 3))
    p[[1, 2, 5] if spherical_shoulder else [2, 5, 6]] = 0.0
    lower, upper = np.full(7, -np.inf), np.full(7, np.inf)
    for i in range(7):
        if rng.random() < 0.75:
            middle, half = rng.uniform(-2, 2), rng.uniform(0.4, 3.0)
            lower[i], upper[i] = middle - half, middle + half
    return Chain(R, p, lower, upper)


def offset_arm(rng):
    """Return a random arm outside the closed-form classes: no two of its axes meet."""
    chain = random_arm(rng)
    return chain._replace(p=rng.uniform(-0.25, 0.25, (8, 3)))


def random_joints(rng, chain):
    """Return joint angles within the limits."""
    free = rng.uniform(-np.pi, np.pi, 7)
    share = rng.random(7)
    limited = np.isfinite(chain.lower)
    lower, upper = np.where(limited, chain.lower, 0.0), np.where(limited, chain.upper, 0.0)
    return np.where(limited, lower + share * (upper - lower), free)


def straight_arm(limits, offset):
    """Return an arm of right angles, like many on the market: straight up at zero.

    Args:
        limits: Greatest angles to either side [rad], shape (7,).
        offset: Of the shoulder from axis 1 [m].
    """
    X = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    R = np.array([np.eye(3), X, X.T, X.T, X, X, X.T, np.eye(3)])
    p = np.zeros((8, 3))
    p[0, 2], p[1, 0], p[3, 2], p[4, 1], p[7, 2] = 0.34, offset, 0.42, -0.4, 0.126
    return Chain(R, p, -limits, limits)


def around(angle):
    """Return angles modulo a full turn, in [-pi, pi]."""
    return np.remainder(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi


SHAPE_TYPES = {"sphere": SPHERE, "capsule": CAPSULE, "box": BOX}


def turned_by(R):
    """Return the small rotation vector of R."""
    return np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
