"""Reference implementation of two arms that reach their goals at the same time, in plain loops."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import FloatArray, GridArrays, SceneArrays
from tcs.kernel.verification.reference import (
    PlacedShape,
    compose,
    coupled_pose,
    free_joint,
    link_poses,
    shapes_of,
    solutions,
)
from tcs.kernel.verification.reference_pairs import PlacedScene, placed_scene

AT_LIMIT = 1e-12
"""Rounding of the slack of an angle that is tried at its limit."""


def arm_in_base(scene: SceneArrays, torso: int, q: FloatArray) -> list[PlacedShape]:
    """Return the shapes of an arm in the base frame B, at joint angles q [rad]."""
    X_BA = scene.arm_base_R[torso], scene.arm_base_p[torso]
    poses = link_poses(scene.chain, q)
    return [
        shape.moved(compose(X_BA, coupled_pose(scene.chain, q, poses, int(frame))))
        for shape, frame in zip(shapes_of(scene.arm, 0), scene.arm.frame, strict=True)
    ]


def arms_touch(
    scenes: tuple[SceneArrays, SceneArrays], torso: int, q: FloatArray, q_other: FloatArray
) -> tuple[bool, float]:
    """Return whether two arms touch, and by how much none of the compared shapes is a tie [m].

    Args:
        scenes: The scene of each arm.
        torso: The torso level.
        q: Joints of the first [rad], shape (7,).
        q_other: Joints of the second [rad], shape (7,).
    """
    first, second = scenes
    shapes, others = arm_in_base(first, torso, q), arm_in_base(second, torso, q_other)
    placed = PlacedScene(first, [], [], (np.eye(3), np.zeros(3)))
    every = np.ones((len(shapes), len(others)), np.bool_)
    margin = max(first.self_margin, second.self_margin)
    return placed.any_touch(shapes, others, every, margin), placed.clearance


def free_postures(
    scene: SceneArrays, grid: GridArrays, h: int, goal: int, angles: FloatArray
) -> list[FloatArray]:
    """Return the solutions of an arm by itself that touch nothing.

    Args:
        scene: The scene, without the other arm.
        grid: The configurations.
        h: Number of the configuration.
        goal: Number of the goal.
        angles: Angles of the free joint to try [rad].
    """
    placed, blocked = placed_scene(scene, grid, h, goal)
    if blocked or placed.gripper_touches(with_body=False) or placed.gripper_touches(with_body=True):
        return []
    found = []
    for angle in angles.tolist():
        for solution in solutions(scene.chain, placed.X_AG, angle).values():
            if solution.slack >= -AT_LIMIT and not placed.arm_touches(solution.q):
                found.append(solution.q)
    return found


def reached_together(
    scenes: tuple[SceneArrays, SceneArrays],
    grid: GridArrays,
    h: int,
    goals: tuple[int, int],
    samples: int,
) -> bool:
    """Return whether both arms reach their goals in postures in which they do not touch.

    Args:
        scenes: The scene of each arm, without the other.
        grid: The configurations.
        h: Number of the configuration.
        goals: Number of the goal of each arm.
        samples: Number of angles of each free joint that are tried.
    """
    torso = h % grid.torso_levels
    postures = []
    for scene, goal in zip(scenes, goals, strict=True):
        joint = free_joint(scene.chain)
        low, high = scene.chain.lower[joint], scene.chain.upper[joint]
        limited = bool(np.isfinite(low))
        first, last = (low, high) if limited else (-math.pi, math.pi)
        angles = np.linspace(first, last, samples, endpoint=limited)
        postures.append(free_postures(scene, grid, h, goal, angles))
    return any(
        not arms_touch(scenes, torso, q, other)[0] for q in postures[0] for other in postures[1]
    )
