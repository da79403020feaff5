"""Random postures of a robot, and one that is free of self-collision."""

from __future__ import annotations

import numpy as np

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.self_collision.plant import SelfCollision

DRAWS = 500
"""Random postures that the search for a collision-free one tries."""


def free_posture(robot: RobotFile, seed: int = 0) -> dict[str, float] | None:
    """Return a posture of the scored arm without self-collision in the pairs scoring checks [rad].

    The candidates are all joints at 0 or at the limit nearest to 0, the middle of every range, and
    random postures; the torso is at its lowest.

    Args:
        robot: The robot.
        seed: Seed of the draws.

    Returns:
        Positions by joint, empty if all joints may be at 0; None if every candidate collides.
    """
    limits = robot.joint_limits()
    plant, others = SelfCollision(robot), robot.joint_positions()
    plant.ignore_unscored(model_with_extras(robot), robot.arm_joints)
    plant.ignore(robot.disabled_pairs)
    bounded = {name: tuple(np.clip(limits[name], -np.pi, np.pi)) for name in robot.arm_joints}
    middle = {name: float(np.mean(pair)) for name, pair in bounded.items()}
    draws = (
        {name: sample[name] for name in robot.arm_joints}
        for sample in sample_positions(robot, DRAWS, seed)
    )
    for drawn in ({}, middle, *draws):
        # Rounded for the file, and still within the limits.
        arm = {name: float(np.clip(round(q, 4), *limits[name])) for name, q in drawn.items()}
        if not plant.touching(robot.with_mimics({**others, **arm})):
            return arm
    return None


def sample_positions(robot: RobotFile, count: int, seed: int) -> list[dict[str, float]]:
    """Return postures drawn uniformly within the limits in force of every joint [rad or m].

    Arm, torso, head, other arm and grippers all move; mimic joints follow their leader, and
    continuous joints are drawn from one revolution.

    Args:
        robot: The robot.
        count: Number of postures.
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
