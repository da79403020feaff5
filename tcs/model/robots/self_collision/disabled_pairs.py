"""Pairs of bodies of a robot that need no collision check, with the evidence for each."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import DisabledGroup, RobotFile
from tcs.model.robots.self_collision.clearance import (
    CLEAR,
    FINER,
    MEETING,
    SurfaceDistance,
    carried_triangles,
    differing,
    free_joints,
    joints_between,
    movable_above,
)
from tcs.model.robots.self_collision.plant import BodyPair, SelfCollision
from tcs.model.robots.self_collision.postures import sample_positions

FloatArray = NDArray[np.float64]

_NEIGHBOURS = "neighbours: one joint connects them"
_APART = "cannot meet: within the {} joint limits"
_ALWAYS = "primitives overlap in each of"
_MOST_JOINTS = 3
"""Most joints between two bodies for which the closest approach is searched."""


def propose_disabled_pairs(
    robot: RobotFile, *, postures: int = 2000, seed: int = 0
) -> tuple[DisabledGroup, ...]:
    """Return the pairs of bodies that need no check, grouped by reason.

    Only pairs with a body that the scored arm moves are considered; scoring checks no others. A
    pair whose primitives touch in no sampled posture stays enabled: its check costs little and may
    find a contact that the samples missed. Of the others a pair is proposed if

    - one joint of the URDF connects the bodies: they touch at the joint, and its limits keep the
      rest apart (this does not apply to an extra body, such as a tool);
    - at most three joints lie between the bodies and their meshes never meet, so only the volume
      that the primitives add touches. If this requires the soft limits, the group holds only while
      they are in force;
    - the primitives touch in every posture, so a check would forbid all of them.

    Args:
        robot: The robot; its present disabled pairs are ignored, and so are their ranges.
        postures: Postures drawn uniformly within the hard limits.
        seed: Seed of the draws.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    robot = robot.without_ranges
    hard, soft = robot.with_choices(limits="hard"), robot.with_choices(limits="soft")
    model = model_with_extras(robot)
    moved, hand = (model.links_moved_by(robot.arm_joints[i]) for i in (0, -1))
    neighbours = neighbouring_pairs(robot)
    touched, always = touching_pairs(
        robot, moved, neighbours, sample_positions(hard, postures, seed), _distant_pairs(robot)
    )
    triangles = carried_triangles(robot, model)
    surfaces = SurfaceDistance(model, triangles)
    fine = SurfaceDistance(model, triangles, scale=FINER, rough=surfaces)
    hard_limits, soft_limits = hard.joint_limits(), soft.joint_limits()
    found = _Found()
    for pair in sorted(touched):
        if not all(surfaces.has(body) for body in pair):
            continue
        if pair in neighbours:
            found.neighbours.append(pair)
            continue
        if set(pair) <= hand:
            # Scoring does not check pairs within the hand.
            continue
        between = free_joints(model, joints_between(model, *pair))
        few = len(between) <= _MOST_JOINTS
        tried = [(hard, found.apart_hard), (soft, found.apart_soft)]
        if all(hard_limits[name] == soft_limits[name] for name in between):
            tried.pop()
        for limits, apart in tried:
            gap = _closest_approach((surfaces, fine), pair, limits, seed) if few else 0.0
            if gap >= MEETING:
                apart[pair] = gap
                break
        else:
            if pair in always:
                found.always.append(pair)
    return found.groups(postures)


def neighbouring_pairs(robot: RobotFile) -> set[BodyPair]:
    """Return the pairs of links of the URDF that one joint connects, each sorted by name."""
    model = robot.model()
    bodies = sorted({shape.body for shape in robot.load_primitives()} & model.links.keys())
    above = {body: movable_above(model, body) for body in bodies}
    pairs = itertools.combinations(bodies, 2)
    return {(a, b) for a, b in pairs if len(differing(above[a], above[b])) == 1}


def _distant_pairs(robot: RobotFile) -> frozenset[BodyPair]:
    """Return the pairs of bodies whose closest approach is not searched, each sorted by name."""
    model = model_with_extras(robot)
    bodies = sorted({shape.body for shape in robot.load_primitives()})
    above = {body: movable_above(model, body) for body in bodies}
    return frozenset(
        (a, b)
        for a, b in itertools.combinations(bodies, 2)
        if len(free_joints(model, differing(above[a], above[b]))) > _MOST_JOINTS
    )


def touching_pairs(
    robot: RobotFile,
    moved: frozenset[str],
    neighbours: set[BodyPair],
    postures: list[dict[str, float]],
    distant: frozenset[BodyPair] = frozenset(),
) -> tuple[set[BodyPair], set[BodyPair]]:
    """Return the pairs with a moved body that touch in any posture, and those that do in all.

    Args:
        robot: The robot.
        moved: The bodies that the scored arm moves.
        neighbours: Pairs that are left out of those that touch in all postures.
        postures: Positions by joint [rad or m].
        distant: Pairs that may be left out of those that touch in any posture, unless they do in
            all.
    """
    plant = SelfCollision(robot)
    plant.ignore_within(plant.bodies - moved)
    touched: set[BodyPair] = set()
    always: set[BodyPair] | None = None
    for posture in postures:
        now = plant.touching(posture)
        if lost := (always or set()) - now:
            plant.compare(lost)
            now |= plant.touching(posture) & lost
        still = (now if always is None else always & now) - neighbours
        # Of a pair that may always touch, one contact tells that it does here. Many shapes of some
        # do: they would take most of the time.
        plant.follow(still if always is None else still & lost)
        # Nothing more is to be learned of neighbours, and of a pair that touches only here or
        # only before.
        settled = (now | (always or set())) - still
        plant.ignore(settled if always is not None else settled | (distant - still))
        touched |= now
        always = set(still)
    return touched, always or set()


def renewed_groups(robot: RobotFile) -> tuple[DisabledGroup, ...]:
    """Return the proposed groups of a robot, after those of its file that were made by hand.

    A group whose reason is not one of `propose_disabled_pairs` was made by hand. Its pairs are left
    out of the others.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    found = (_NEIGHBOURS, *(_APART.format(limits) for limits in ("hard", "soft")), _ALWAYS)
    kept = tuple(g for g in robot.disabled_groups if not g.reason.startswith(found))
    by_hand = {frozenset(pair) for group in kept for pair in group.pairs}
    proposed = (
        group.model_copy(
            update={"pairs": tuple(p for p in group.pairs if frozenset(p) not in by_hand)}
        )
        for group in propose_disabled_pairs(robot)
    )
    return (*kept, *(group for group in proposed if group.pairs))


def _closest_approach(
    surfaces: tuple[SurfaceDistance, SurfaceDistance], pair: BodyPair, robot: RobotFile, seed: int
) -> float:
    """Return the least distance of two surfaces within the limits in force [m].

    Args:
        surfaces: The surfaces at the usual scale, and finer for parts that pass each other closely.
        pair: Names of the bodies.
        robot: The robot, with its limits in force.
        seed: Seed of the draws.
    """
    usual, fine = surfaces
    gap = usual.closest_approach(pair, robot, seed)
    return fine.closest_approach(pair, robot, seed) if MEETING <= gap < CLEAR else gap


@dataclass
class _Found:
    """Pairs by the reason why they need no check; distances are closest approaches [m]."""

    neighbours: list[BodyPair] = field(default_factory=list)
    apart_hard: dict[BodyPair, float] = field(default_factory=dict)
    apart_soft: dict[BodyPair, float] = field(default_factory=dict)
    always: list[BodyPair] = field(default_factory=list)

    def groups(self, postures: int) -> tuple[DisabledGroup, ...]:
        """Return the groups that are not empty."""
        apart = (
            _APART + " their surfaces stay {:.0f} mm apart or more; "
            "only the volume that primitives add to them touches"
        )
        hard, soft = (
            apart.format(limits, np.floor(min(pairs.values(), default=0.0) * 1e3))
            for limits, pairs in (("hard", self.apart_hard), ("soft", self.apart_soft))
        )
        neighbours = _NEIGHBOURS + ", and its limits keep them apart"
        always = (
            f"{_ALWAYS} {postures} postures: parts of one joint assembly, so a "
            "check would forbid every posture"
        )
        groups = (
            DisabledGroup(reason=neighbours, pairs=tuple(self.neighbours)),
            DisabledGroup(reason=hard, pairs=tuple(self.apart_hard)),
            DisabledGroup(reason=always, pairs=tuple(self.always)),
            DisabledGroup(reason=soft, limits="soft", pairs=tuple(self.apart_soft)),
        )
        return tuple(group for group in groups if group.pairs)
