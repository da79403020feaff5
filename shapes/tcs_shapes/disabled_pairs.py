"""Pairs of bodies of a robot that need no collision check, with the evidence for each."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from joblib import delayed
from numpy.typing import NDArray

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import DisabledGroup, RobotFile
from tcs.model.robots.urdf import Urdf
from tcs_shapes.clearance import (
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
from tcs_shapes.processes import ordered
from tcs_shapes.self_collision import BodyPair, SelfCollision, sample_positions

FloatArray = NDArray[np.float64]

_NEIGHBOURS = "neighbours: one joint connects them"
_APART = "cannot meet: within the {} joint limits"
_ALWAYS = "primitives overlap in each of"
_MOST_JOINTS = 3
"""Most joints between two bodies for which the closest approach is searched."""


def propose_disabled_pairs(
    robot: RobotFile, *, postures: int = 2000, seed: int = 0, jobs: int = 1
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
        jobs: Number of processes; does not change the result.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    robot = robot.without_ranges
    hard, soft = robot.with_choices(limits="hard"), robot.with_choices(limits="soft")
    model = model_with_extras(robot)
    moved, hand = (model.links_moved_by(robot.arm_joints[i]) for i in (0, -1))
    neighbours = neighbouring_pairs(robot)
    touched, always = _touching_pairs(
        robot, moved, neighbours, sample_positions(hard, postures, seed), jobs
    )
    triangles = carried_triangles(robot, model)
    hard_limits, soft_limits = hard.joint_limits(), soft.joint_limits()
    found, tasks = _Found(), {}
    for pair in sorted(touched):
        if not all(body in triangles for body in pair):
            continue
        if pair in neighbours:
            found.neighbours.append(pair)
            continue
        if set(pair) <= hand:
            # Scoring does not check pairs within the hand.
            continue
        between = free_joints(model, joints_between(model, *pair))
        if len(between) > _MOST_JOINTS:
            found.add(pair, None, pair in always)
            continue
        is_alike = all(hard_limits[name] == soft_limits[name] for name in between)
        tasks[pair] = (hard,) if is_alike else (hard, soft)
    for pair, gap in _gaps(model, triangles, tasks, seed, jobs).items():
        found.add(pair, gap, pair in always)
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


def _touching_pairs(
    robot: RobotFile,
    moved: frozenset[str],
    neighbours: set[BodyPair],
    postures: Sequence[dict[str, float]],
    jobs: int,
) -> tuple[set[BodyPair], set[BodyPair]]:
    """Return what `touching_pairs` does of the pairs that matter, its postures shared by processes.

    Args:
        robot: The robot.
        moved: The bodies that the scored arm moves.
        neighbours: Pairs that are left out of those that touch in all postures.
        postures: Positions by joint [rad or m].
        jobs: Number of processes.
    """
    distant = _distant_pairs(robot)
    parts = [list(postures[k::jobs]) for k in range(min(jobs, len(postures)))]
    found = ordered(
        jobs,
        (delayed(touching_pairs)(robot, moved, neighbours, part, distant) for part in parts),
    )
    touched, always = zip(*found, strict=True)
    return set().union(*touched), set.intersection(*always)


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


_Gap = tuple[str, float]
"""Limits within which two surfaces stay apart, "hard" or "soft", and their least distance [m]."""


def _gaps(
    model: Urdf,
    triangles: Mapping[str, FloatArray],
    tasks: Mapping[BodyPair, tuple[RobotFile, ...]],
    seed: int,
    jobs: int,
) -> dict[BodyPair, _Gap | None]:
    """Return the gaps of pairs, in their order; None if two surfaces may meet.

    Args:
        model: The robot.
        triangles: Surface of each body in its frame [m], shapes (n, 3, 3).
        tasks: The robot with the limits to try one after the other, by pair.
        seed: Seed of the draws.
        jobs: Number of processes.
    """
    # The largest surfaces, which take longest, are shared out first.
    by_size = sorted(tasks, key=lambda pair: sorted(-len(triangles[body]) for body in pair))
    shares = [{pair: tasks[pair] for pair in by_size[k::jobs]} for k in range(jobs)]
    calls = (
        delayed(_gaps_of)(model, {b: triangles[b] for pair in share for b in pair}, share, seed)
        for share in shares
        if share
    )
    found = ordered(jobs, calls)
    gaps = {pair: gap for share in found for pair, gap in share.items()}
    return {pair: gaps[pair] for pair in tasks}


def _gaps_of(
    model: Urdf,
    triangles: Mapping[str, FloatArray],
    tasks: Mapping[BodyPair, tuple[RobotFile, ...]],
    seed: int,
) -> dict[BodyPair, _Gap | None]:
    """Return the gaps of pairs, one after the other."""
    usual = SurfaceDistance(model, triangles)
    fine = SurfaceDistance(model, triangles, scale=FINER, rough=usual)
    gaps: dict[BodyPair, _Gap | None] = dict.fromkeys(tasks)
    for pair, tried in tasks.items():
        for limits, robot in zip(("hard", "soft"), tried, strict=False):
            gap = usual.closest_approach(pair, robot, seed)
            if MEETING <= gap < CLEAR:
                # Parts that pass each other closely.
                gap = fine.closest_approach(pair, robot, seed)
            if gap >= MEETING:
                gaps[pair] = limits, gap
                break
    return gaps


@dataclass
class _Found:
    """Pairs by the reason why they need no check; distances are closest approaches [m]."""

    neighbours: list[BodyPair] = field(default_factory=list)
    apart_hard: dict[BodyPair, float] = field(default_factory=dict)
    apart_soft: dict[BodyPair, float] = field(default_factory=dict)
    always: list[BodyPair] = field(default_factory=list)

    def add(self, pair: BodyPair, gap: _Gap | None, is_always: bool) -> None:
        """Add a pair that is no pair of neighbours, if it needs no check.

        Args:
            pair: Names of the bodies.
            gap: Its gap, if there is any.
            is_always: Whether its primitives touch in every posture.
        """
        if gap is not None:
            limits, away = gap
            (self.apart_hard if limits == "hard" else self.apart_soft)[pair] = away
        elif is_always:
            self.always.append(pair)

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
