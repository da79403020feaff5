"""All solutions of an arm of six joints by Newton's method from many starts, in plain numpy.

It shares no code with `tcs.kernel.six_joints`, whose closed form it checks.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray

STARTS = 400
"""Number of starts, spread over full turns of all joints."""
ITERATIONS = 32
"""Number of damped Newton iterations; most starts that converge at all take a dozen."""
LONGEST_STEP = 0.6
"""Longest step of an iteration [rad, norm of the joints]."""
DAMPING = 1e-6
"""Damping relative to the squared error: none next to a solution."""
ARRIVED = 1e-9
"""Greatest error of a solution [rad and m]."""
APART = 1e-5
"""Least distance of two solutions [rad]."""


def newton_solutions(
    chain: Chain, R_AG: FloatArray, p_AG: FloatArray, starts: int = STARTS
) -> FloatArray:
    """Return the solutions of an arm of six joints at a pose, joint limits left aside.

    Args:
        chain: The arm.
        R_AG: Goal orientation in the arm base A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        starts: Number of starts.

    Returns:
        Joint angles in (-pi, pi], the first one 0 [rad], shape (n, 7).
    """
    q = np.zeros((starts, 7))
    q[:, 1:] = np.random.default_rng(0).uniform(-np.pi, np.pi, (starts, 6))
    turns = chain.slides == 0.0
    arrived = [np.empty((0, 7))]
    for _ in range(ITERATIONS):
        error, J = _errors(chain, q, R_AG, p_AG)
        near = np.abs(error).max(axis=1) < ARRIVED
        arrived.append(q[near])
        q, error, J = q[~near], error[~near], J[~near]
        damped = J @ np.swapaxes(J, 1, 2)
        damped += (DAMPING * np.sum(error**2, axis=1) + 1e-15)[:, None, None] * np.eye(6)
        step = (np.swapaxes(J, 1, 2) @ np.linalg.solve(damped, error[..., None]))[..., 0]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        q[:, 1:] += step * np.minimum(1.0, LONGEST_STEP / np.maximum(length, 1e-300))
    found = np.concatenate(arrived)
    found[:, turns] = np.pi - np.remainder(np.pi - found[:, turns], 2.0 * np.pi)
    return _distinct(found)


def within(chain: Chain, solutions: FloatArray) -> FloatArray:
    """Return the solutions within the joint limits, shifted into them by full turns, (n, 7)."""
    limited = np.isfinite(chain.lower) & np.isfinite(chain.upper)
    middle = np.where(limited, chain.lower, 0.0) / 2 + np.where(limited, chain.upper, 0.0) / 2
    turns = np.ceil((solutions - middle - np.pi) / (2.0 * np.pi)) * (chain.slides == 0.0)
    shifted = solutions - turns * 2.0 * np.pi
    inside = np.all((shifted >= chain.lower) & (shifted <= chain.upper), axis=1)
    return np.asarray(shifted[inside])


def _distinct(solutions: FloatArray) -> FloatArray:
    """Return solutions that differ from all before them by more than APART, but for full turns."""
    kept: list[FloatArray] = []
    for q in solutions:
        away = [np.abs(np.angle(np.exp(1j * (q - other)))).max() for other in kept]
        if min(away, default=np.inf) > APART:
            kept.append(q)
    return np.array(kept).reshape(-1, 7)


def _errors(
    chain: Chain, q: FloatArray, R_AG: FloatArray, p_AG: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return pose errors (n, 6) [rad; m] and Jacobians (n, 6, 6) of joints 2 to 7."""
    R, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
    axes, origins = [], []
    for i in range(7):
        slide = chain.slides[i]
        p, R = p + R @ chain.p[i], R @ chain.R[i]
        if slide:
            p = p + R[:, :, 2] * (slide * q[:, i, None])
        else:
            R = R @ _rotations(q[:, i])
        axes.append(R[:, :, 2])
        origins.append(p)
    p, R = p + R @ chain.p[7], R @ chain.R[7]
    columns = [
        np.concatenate([np.zeros_like(z), slide * z], axis=1)
        if slide
        else np.concatenate([z, np.cross(z, p - o)], axis=1)
        for z, o, slide in zip(axes[1:], origins[1:], chain.slides[1:], strict=True)
    ]
    # The rotation vector from the tool to the goal: half the antisymmetric part, to its full angle.
    E = R_AG @ np.swapaxes(R, 1, 2)
    skew = 0.5 * np.stack(
        [E[:, 2, 1] - E[:, 1, 2], E[:, 0, 2] - E[:, 2, 0], E[:, 1, 0] - E[:, 0, 1]], axis=1
    )
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(E, axis1=1, axis2=2) - 1.0))
    scale = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    return np.concatenate([skew * scale[:, None], p_AG - p], axis=1), np.stack(columns, axis=2)


def _rotations(angles: FloatArray) -> FloatArray:
    """Return rotations about z, shape (n, 3, 3)."""
    R = np.zeros((len(angles), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angles)
    R[:, 1, 0] = np.sin(angles)
    R[:, 0, 1] = -R[:, 1, 0]
    R[:, 2, 2] = 1.0
    return R
