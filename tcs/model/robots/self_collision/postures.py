"""Random postures of a robot, and one that is free of self-collision."""

from __future__ import annotations

import numpy as np

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.self_collision.plant import SelfCollision

DRAWS = 500
"""Random postures among which one that is free is looked for."""


def free_posture(robot: RobotFile, seed: int = 0) -> dict[str, float] | None:
    """Return a posture of the scored arm in which no pair that scoring checks touches [rad].

    Everything at 0, or at the nearest limit, is tried first, then the middle of every range, then
    random postures; the torso is down.

    Args:
        robot: The robot.
        seed: Seed of the draws.

    Returns:
        Positions by joint: none where 0 will do; None when nothing tried is free.
    """
    model, limits = model_with_extras(robot), robot.joint_limits()
    moved, hand = (model.links_moved_by(robot.arm_joints[i]) for i in (0, -1))
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    judge, standing = SelfCollision(robot), robot.joint_positions()
    bounded = {name: tuple(np.clip(limits[name], -np.pi, np.pi)) for name in robot.arm_joints}
    middle = {name: float(np.mean(pair)) for name, pair in bounded.items()}
    draws = (
        {name: sample[name] for name in robot.arm_joints}
        for sample in sample_positions(robot, DRAWS, seed)
    )
    for drawn in ({}, middle, *draws):
        # As it will be written: with few digits, and still within limits.
        arm = {name: float(np.clip(round(q, 4), *limits[name])) for name, q in drawn.items()}
        touching = judge.touching(robot.with_mimics({**standing, **arm}))
        checked = (pair for pair in touching if moved & set(pair) and not set(pair) <= hand)
        if not any(frozenset(pair) not in off for pair in checked):
            return arm
    return None


def sample_positions(robot: RobotFile, count: int, seed: int) -> list[dict[str, float]]:
    """Return postures spread uniformly over every joint's limits in force [rad or m].

    Arm, torso, head, other arm and grippers all move; joints that mimic another follow it, and
    those that turn on and on take one full turn.

    Args:
        robot: The robot.
        count: How many postures.
        seed: Seed of the draws.
    """
    rng = np.random.default_rng(seed)
    joints = robot.model().joints
    limits = robot.joint_limits()
    free = [name for name in limits if joints[name].mimic is None]
    lower = np.array([max(limits[name][0], -np.pi) for name in free])
    upper = np.array([min(limits[name][1], np.pi) for name in free])
    return [
        robot.with_mimics(dict(zip(free, map(float, draw), strict=True)))
        for draw in rng.uniform(lower, upper, size=(count, len(free)))
    ]
