"""How many postures the shapes of a robot block although its surfaces are free of contact."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from tcs.model.robots.distances import DistanceTable, tables_in_force
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.self_collision.clearance import (
    SPACING,
    SurfaceDistance,
    carried_surfaces,
)
from tcs.model.robots.self_collision.plant import BodyPair, SelfCollision
from tcs.model.robots.self_collision.postures import sample_positions


@dataclass(frozen=True)
class Blocked:
    """Postures that are free of contact by the surfaces, and those that shapes block.

    Attributes:
        free: Number of random postures whose surfaces are free of contact.
        blocked: Number of these in which shapes touch, or a joint is outside a range to which a
            group of disabled pairs keeps it.
        pairs: The pairs of bodies whose shapes touch, and in how many of these postures, most
            frequent first.
        partner: What the arm may touch: the robot itself, or random boxes.
    """

    free: int
    blocked: int
    pairs: tuple[tuple[BodyPair, int], ...]
    partner: str = "self-collision"

    @property
    def fraction(self) -> float:
        """Fraction of the free postures that shapes block, 0 without free postures."""
        return self.blocked / self.free if self.free else 0.0

    def worst(self, allowed: float) -> tuple[BodyPair, ...]:
        """Return the pairs that block most, as many as leave the others a fraction of postures.

        Args:
            allowed: Greatest fraction of the free postures that the others block together.
        """
        left = np.cumsum([count for _, count in self.pairs][::-1])[::-1]
        return tuple(
            pair
            for (pair, _), rest in zip(self.pairs, left, strict=True)
            if rest > allowed * self.free
        )

    def text(self) -> str:
        """Return the figures in one line, with the three worst pairs."""
        worst = "; ".join(
            f"{first} against {second} {count / self.free:.1%}"
            for (first, second), count in self.pairs[:3]
        )
        found = (
            f"of {self.free:,} random postures whose surfaces are free of {self.partner}, the "
            f"shapes block {self.fraction:.1%}"
        )
        return f"{found}: {worst}" if worst else found


def blocked_by_shapes(
    robot: RobotFile,
    *,
    postures: int = 300,
    seed: int = 0,
    surfaces: SurfaceDistance | None = None,
) -> Blocked:
    """Return how many postures the shapes block although the surfaces are free of contact.

    Arm and torso are drawn within the joint limits, everything else keeps its posture. Shapes
    enclose the surfaces, so only pairs whose shapes touch need the distance of the surfaces, which
    are sampled as points: a distance below their spacing counts as contact. Pairs that a table of
    distances shows to be apart do not touch. Postures outside the
    ranges of disabled groups are drawn too, and count as blocked if their surfaces are free.

    Args:
        robot: The robot.
        postures: Number of random postures.
        seed: Seed of the draws.
        surfaces: Its surfaces, as of `carried_surfaces`, if they are known.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    model = model_with_extras(robot)
    surfaces = surfaces or carried_surfaces(robot)
    limits, off = robot.joint_limits(), {frozenset(pair) for pair in robot.disabled_pairs}
    narrowed = {frozenset(p) for g in robot.disabled_groups if g.ranges for p in g.pairs}
    plant = SelfCollision(robot)
    plant.ignore_unscored(model, robot.arm_joints)
    plant.ignore(pair for pair in robot.disabled_pairs if frozenset(pair) not in narrowed)
    tables = {frozenset(table.pair): table for table in tables_in_force(robot)}
    free = blocked = 0
    pairs = Counter[BodyPair]()
    for positions in drawn_positions(robot, postures, seed):
        is_within = all(limits[n][0] <= positions[n] <= limits[n][1] for n in robot.arm_joints)
        exempt = off if is_within else off - narrowed
        touching = [
            pair
            for pair in plant.touching(positions)
            if frozenset(pair) not in exempt
            and not _are_apart(tables.get(frozenset(pair)), positions, robot.self_margin)
        ]
        if any(surfaces.distance(pair, positions) < SPACING for pair in touching):
            continue
        free += 1
        blocked += bool(touching) or not is_within
        pairs.update(touching)
    return Blocked(free, blocked, ranked(pairs))


def _are_apart(table: DistanceTable | None, positions: Mapping[str, float], margin: float) -> bool:
    """Return whether a table shows that two surfaces keep a margin [m]."""
    return table is not None and table.bound(positions) >= margin


def drawn_positions(robot: RobotFile, postures: int, seed: int) -> Iterator[Mapping[str, float]]:
    """Yield random positions of arm and torso, all other joints at those of the robot file.

    Args:
        robot: The robot; ranges of its disabled groups are ignored.
        postures: Number of postures.
        seed: Seed of the draws.
    """
    others = robot.with_mimics(robot.joint_positions())
    scored = [*robot.arm_joints, *([robot.torso_joint] if robot.torso_joint else [])]
    for sample in sample_positions(robot.without_ranges, postures, seed):
        yield others | {name: sample[name] for name in scored}


def ranked(pairs: Counter[BodyPair]) -> tuple[tuple[BodyPair, int], ...]:
    """Return pairs with their counts, the most frequent first."""
    return tuple(sorted(pairs.items(), key=lambda item: (-item[1], item[0])))
