"""The pair of robot bodies that refuses most goals, if it refuses more than are reached."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.files.mapped import chunks
from tcs.model.robots import RobotFile
from tcs.placement.tables import Reason, ScoreTable

FEWEST = 20
"""Fewest refusals by one pair that count: fewer occur by chance on a small grid."""


@dataclass(frozen=True, slots=True)
class SelfContact:
    """A pair of robot bodies that refuses more goals than the robot reaches.

    Attributes:
        bodies: Names of the bodies.
        refused: Number of pairs of configuration and goal for which it is the contact found.
        reached: Number of pairs reached.
    """

    bodies: tuple[str, str]
    refused: int
    reached: int

    def to_json(self) -> dict[str, Any]:
        """Return the contact as plain containers."""
        return {"bodies": list(self.bodies), "refused": self.refused, "reached": self.reached}

    def advice(self, robot: RobotFile) -> str:
        """Return what the contact means and what to change in a robot file, in one line."""
        first, second = self.bodies
        limits = (
            "; pairs exempt within the soft limits only are checked under 'limits: hard'"
            if robot.limits == "hard" and any(g.limits == "soft" for g in robot.disabled_groups)
            else ""
        )
        return (
            f"contact of '{first}' with '{second}' of robot '{robot.name}' refuses "
            f"{self.refused:,} pairs of configuration and goal, more than the {self.reached:,} "
            "reached. If the two cannot touch, list them under disabled_groups, or reduce "
            f"self_margin ({robot.self_margin:g} m){limits}."
        )


def prevailing_self_contact(
    tables: Iterable[ScoreTable], robot_bodies: Collection[str]
) -> SelfContact | None:
    """Return the pair of robot bodies that refuses more goals than are reached, None without one.

    The scores hold a contact for every goal that the arm or the gripper is refused, so counting
    them costs milliseconds. A robot that moves freely refuses few goals by self-collision: with the
    shipped robots the most frequent pair refuses at most a fiftieth of the number reached. A pair
    whose shapes touch in every posture refuses nearly all that are within reach.

    Args:
        tables: Scores of every observed state.
        robot_bodies: Names of the robot's bodies.
    """
    refused: dict[tuple[str, str], int] = {}
    reached = 0
    for scores in tables:
        reached += int(scores.reached.sum())
        counts = np.zeros(len(scores.pair_names), dtype=np.int64)
        for rows in chunks(scores.reason, scores.pair):
            arm = np.isin(
                scores.reason[rows], (Reason.ARM_BLOCKED, Reason.GRIPPER_BLOCKED_BY_ROBOT)
            )
            counts += np.bincount(scores.pair[rows][arm], minlength=len(counts))
        for bodies, count in zip(scores.pair_names, counts.tolist(), strict=True):
            if bodies[1] in robot_bodies:
                refused[bodies] = refused.get(bodies, 0) + count
    if not refused:
        return None
    worst = max(refused, key=lambda bodies: refused[bodies])
    if refused[worst] < FEWEST or refused[worst] <= reached:
        return None
    return SelfContact(worst, refused[worst], reached)
