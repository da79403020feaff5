"""Groups of shapes: boxes enclose them, and postures and curves are judged as without groups."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.approach.scene import approach_scene
from tcs.kernel.arrays import BOX, CAPSULE
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.box_trees import NONE, boxes_around, grouped
from tcs.kernel.motion.edges import NO_PAIR, certified, posture_contact
from tcs.kernel.motion.never_in_contact import with_needed_pairs
from tcs.kernel.motion.scene import (
    carriers,
    motion_scene,
    new_motion_workspace,
    placed,
    torso_scene,
)
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tests.kernel.arms import drake_arm
from tests.kernel.motion.test_separating_planes import corners, place
from tests.kernel.motion.toys import HERE, within_limits
from tests.kernel.shapes import rotation
from tests.kernel.toy import toy_grid, toy_scene
from tests.reference.motion import least_excess, straight_curve
from tests.reference.pairs import placed_scene

COPIES = 8


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


@pytest.fixture(scope="module")
def many(chain):
    """Return a random scene whose arm has each of its shapes eight times, each time elsewhere."""
    rng = np.random.default_rng(3)
    scene = toy_scene(chain, 0, obstacles=12)
    which = np.tile(np.arange(len(scene.arm.type)), COPIES)
    arm = scene.arm._replace(
        type=scene.arm.type[which],
        size=0.5 * scene.arm.size[which],
        pad=scene.arm.pad[which],
        body=scene.arm.body[which],
        frame=scene.arm.frame[which],
        R=np.array([[rotation(rng) for _ in which]]),
        p=scene.arm.p[:, which] + rng.normal(scale=0.04, size=(1, len(which), 3)),
    )
    return scene._replace(
        arm=arm,
        arm_vs_arm=scene.arm_vs_arm[np.ix_(which, which)],
        arm_vs_body=scene.arm_vs_body[which],
        arm_vs_environment=scene.arm_vs_environment[which],
    )


@pytest.fixture(scope="module")
def plain(many):
    """Return that scene, prepared at one configuration."""
    return with_needed_pairs(motion_scene(build_problem(many), rows_at(toy_grid(), [HERE])))


def extremes(row):
    """Return points of a packed shape that are farthest along the axes of its frame, (n, 3)."""
    R, size = row[ROTATION:].reshape(3, 3), row[SIZE : SIZE + 3]
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    if row[TYPE] == BOX:
        return row[CENTRE : CENTRE + 3] + (np.sign(axes @ R) * size) @ R.T
    half = size[1] if row[TYPE] == CAPSULE else 0.0
    return row[CENTRE : CENTRE + 3] + size[0] * axes + np.sign(axes @ R[:, 2:]) * half * R[:, 2]


def test_boxes_enclose_the_shapes_in_them(plain):
    count = len(plain.shapes.links)
    groups = boxes_around(plain.shapes.links, plain.shapes.link_frame, plain.shapes.body[:count])
    assert len(groups.rows) > count
    for box in range(count, len(groups.rows)):
        members, shapes = [box], []
        while members:
            one = members.pop()
            members += groups.parts[one].tolist() if groups.parts[one, 0] != NONE else []
            shapes += [one] if one < count else []
        assert len(shapes) > 1
        assert set(groups.frame[shapes]) == {groups.frame[box]}
        for shape in shapes:
            beyond = extremes(groups.rows[shape]) - groups.rows[box, CENTRE : CENTRE + 3]
            assert np.all(np.abs(beyond) <= groups.rows[box, SIZE : SIZE + 3])
            assert np.max(np.linalg.norm(beyond, axis=1)) <= groups.rows[box, BOUND]


def test_every_pair_of_shapes_is_below_a_pair_that_is_checked(plain):
    scene = grouped(plain)
    alone = scene.pairs.below[:, 0] == scene.pairs.below[:, 1]
    added = len(scene.shapes.links) - len(plain.shapes.links)
    assert added > 0

    def named(pair, count, shift):
        fixed = pair[:, 1] >= count
        return set(zip(pair[:, 0].tolist(), (pair[:, 1] - shift * fixed).tolist(), strict=True))

    found = named(scene.pairs.members[alone], len(scene.shapes.links), added)
    assert found == named(plain.pairs.members, len(plain.shapes.links), 0)
    seen = list(range(scene.pairs.first[-1]))
    for k in seen:
        seen += range(*scene.pairs.below[k])
    assert sorted(seen) == list(range(len(scene.pairs.members)))
    bodies = {
        (int(scene.shapes.body[i]), int(scene.shapes.body[j]))
        for i, j in scene.pairs.members[alone, :2]
    }
    assert bodies == {
        (int(plain.shapes.body[i]), int(plain.shapes.body[j]))
        for i, j in plain.pairs.members[:, :2]
    }


def test_postures_and_curves_are_judged_as_without_groups(plain, chain, rng):
    scene = grouped(plain)
    work, plain_work = new_motion_workspace(scene), new_motion_workspace(plain)
    free, blocked = [], 0
    while min(len(free), blocked) < 25:
        q = within_limits(rng, chain)
        touches = posture_contact(plain, plain_work, q) != NO_PAIR
        assert (posture_contact(scene, work, q) != NO_PAIR) == touches
        blocked += touches
        free += [] if touches else [q]
    outcomes = []
    for q in free:
        curve = straight_curve(q, q + rng.normal(scale=0.3, size=7))
        outcomes.append(certified(scene, work, curve) == 1.0)
        assert outcomes[-1] == (certified(plain, plain_work, curve) == 1.0)
    assert 3 < sum(outcomes) < len(outcomes)


def test_a_scene_is_placed_at_every_configuration(many, chain, rng):
    problem = build_problem(many)
    grid = toy_grid()
    judged = []
    for torso in range(len(problem.arm_base.R)):
        scene = grouped(torso_scene(problem, torso))
        # Of both states of the environment, far from each other.
        for h in (torso, grid.size // 2 + 4 * grid.torso_levels + torso):
            # Placing again replaces where the environment was.
            scene = placed(scene, problem, rows_at(grid, [h]))
            work, reference = new_motion_workspace(scene), placed_scene(many, grid, h, 0)[0]
            for _ in range(6):
                q = within_limits(rng, chain)
                touches = least_excess(reference, q) < 0.0
                assert (posture_contact(scene, work, q) != NO_PAIR) == touches
                judged.append(touches)
    assert 2 < sum(judged) < len(judged) - 2


def shapes_in(scene, box):
    """Return the shapes of the arm or around it that are in a box around fixed shapes."""
    below = [
        k
        for k in np.flatnonzero(scene.pairs.members[:, 1] == box)
        if np.ptp(scene.pairs.below[k]) > 0
    ]
    members = []
    while below:
        k = below.pop()
        below += range(*scene.pairs.below[k])
        members += [] if np.ptp(scene.pairs.below[k]) else [int(scene.pairs.members[k, 1])]
    return set(members)


def test_shapes_of_the_base_are_in_boxes_at_every_torso_level(many, chain, rng):
    # Copies of a shape stay together: the shapes of a body are contiguous.
    which = np.repeat(np.arange(len(many.body.type)), 2 * COPIES)
    body = many.body._replace(
        type=many.body.type[which],
        size=0.3 * many.body.size[which],
        pad=many.body.pad[which],
        body=many.body.body[which],
        frame=many.body.frame[which],
        R=many.body.R[:, which],
        p=many.body.p[:, which] + rng.normal(scale=0.1, size=(1, len(which), 3)),
    )
    scene = many._replace(
        body=body,
        arm_vs_body=many.arm_vs_body[:, which],
        body_vs_environment=many.body_vs_environment[which],
    )
    problem = build_problem(scene)
    lines = approach_scene(problem)
    arm = len(lines.motion.shapes.links)
    shift = arm + problem.environment.body.size
    first = shift + len(problem.body.body)
    assert first < arm + len(lines.motion.shapes.fixed)
    assert len(problem.arm_base.R) > 1
    for n in range(first, arm + len(lines.motion.shapes.fixed)):
        members = [i - shift for i in shapes_in(lines.motion, n)]
        assert members
        for torso in range(len(problem.arm_base.R)):
            still = lines.motion.shapes.fixed[n - arm]
            box = np.concatenate([lines.moved[torso, lines.moving == n], still[None]])[0]
            for row in problem.body.shapes_A[torso, members]:
                beyond = (extremes(row) - box[CENTRE : CENTRE + 3]) @ box[ROTATION:].reshape(3, 3)
                assert np.all(np.abs(beyond) <= box[SIZE : SIZE + 3])
    for torso in range(len(problem.arm_base.R)):
        plain, at = torso_scene(problem, torso), rows_at(toy_grid(), [torso])
        of_base = placed(grouped(plain, carriers(problem)), problem, at)
        plain = placed(plain, problem, at)
        works = new_motion_workspace(of_base), new_motion_workspace(plain)
        for _ in range(40):
            q = within_limits(rng, chain)
            found = [
                posture_contact(one, work, q) != NO_PAIR
                for one, work in zip((of_base, plain), works, strict=True)
            ]
            assert found[0] == found[1]


def test_an_arm_of_few_shapes_is_left_as_it_is(chain):
    scene = motion_scene(build_problem(toy_scene(chain, 0)), rows_at(toy_grid(), [HERE]))
    assert grouped(scene) is scene


def test_the_motion_of_shapes_in_boxes_is_bounded(many, chain, rng):
    """Of all links before their own, as pairs of two links need it."""
    scene = grouped(motion_scene(build_problem(many), rows_at(toy_grid(), [HERE])))
    assert np.count_nonzero(scene.shapes.root != np.arange(len(scene.shapes.root))) > 50
    work, closer = new_motion_workspace(scene), []
    for _ in range(12):
        start = within_limits(rng, chain)
        control = start + np.linspace(0.0, 1.0, 4)[:, None] * rng.normal(size=7) * 0.1
        control[1:3] += rng.normal(size=(2, 7)) * 0.01
        place(scene, work, control, 0.5, 0.5)
        bound = work.piece.motion.copy()
        middle, frames = corners(work.posture.shapes[: len(scene.shapes.links)]), poses(work)
        moved = np.zeros((len(scene.shapes.links), 8))
        for t in np.linspace(0.0, 1.0, 11):
            place(scene, work, control, t, 0.0)
            here, now = corners(work.posture.shapes[: len(scene.shapes.links)]), poses(work)
            for base in range(7):
                # The points as seen from the base link, moved back to where that was in the middle.
                R = frames[0][base] @ now[0][base].T
                seen = (here - now[1][base]) @ R.T + frames[1][base]
                away = np.linalg.norm(seen - middle, axis=2).max(axis=1)
                moved[:, base] = np.maximum(moved[:, base], away)
        before = np.arange(8) < scene.shapes.link_frame[:, None]
        # Rounding errors of positions are below 1e-12.
        assert np.all(moved[before] <= bound[before] + 1e-12)
        closer.append(bound[:, 0] < bound[scene.shapes.root, 0])
    # Most shapes move less than the box around those of their link.
    assert np.mean(closer) > 0.5


def poses(work):
    """Return orientations and origins of the links in A."""
    return work.posture.link_R.copy(), work.posture.link_p.copy()
