"""Self-collision: checked pairs detect real contact, and the others need no check."""

from dataclasses import replace

import numpy as np
import pytest

from tcs.model.robots import load_robot
from tcs.model.robots.robot_file import DisabledGroup, RobotFile
from tcs.model.robots.urdf.surfaces import body_triangles, welded_top
from tcs_shapes.blocked import blocked_at_boxes, blocked_by_shapes
from tcs_shapes.clearance import CLEAR, SurfaceDistance, free_joints, joints_between
from tcs_shapes.disabled_pairs import (
    neighbouring_pairs,
    propose_disabled_pairs,
    renewed_groups,
    touching_pairs,
)
from tcs_shapes.draft import draft_robot, write_draft
from tcs_shapes.self_collision import SelfCollision, sample_positions
from tests.chosen import some_of
from tests.model.robots.made_up import urdf


@pytest.fixture(scope="module")
def judge(pr2):
    return SelfCollision(pr2)


@pytest.fixture(scope="module")
def hulls(pr2):
    return SelfCollision(pr2, hulls=True)


@pytest.fixture(scope="module")
def arm_bodies(pr2):
    model = pr2.model()
    first = model.joints[pr2.arm_joints[0]].child
    return {body for body in model.links if model.chain(first, body) is not None}


def test_leaving_out_settled_pairs_changes_no_verdict(tmp_path):
    """What the search for pairs sees is what all pairs at all postures show."""
    file = tmp_path / "made_up.urdf"
    file.write_text(urdf())
    draft = draft_robot(file, "tool")
    write_draft(draft, tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    moved = robot.model().links_moved_by(robot.arm_joints[0])
    neighbours = neighbouring_pairs(robot)
    drawn = sample_positions(robot, 200, seed=5)
    touched, always = touching_pairs(robot, moved, neighbours, drawn)
    plant = SelfCollision(robot)
    found = [{p for p in plant.touching(q) if moved & set(p)} for q in drawn]
    assert touched == set.union(*found)
    assert always == set.intersection(*found) - neighbours
    # Pairs of which only contact in all postures counts are settled by the first.
    distant = frozenset(touched - neighbours)
    for pair in distant:
        some = [n for n, pairs in enumerate(found) if pair in pairs]
        _, still = touching_pairs(robot, moved, neighbours, [drawn[n] for n in some], distant)
        assert still == set.intersection(*(found[n] for n in some)) - neighbours
        assert pair in still
    assert len(touched - neighbours) >= 3
    assert ("arm1", "arm2") in neighbours
    assert ("arm1", "arm3") not in neighbours
    plant.ignore_unscored(robot.model(), robot.arm_joints)
    hand = robot.model().links_moved_by(robot.arm_joints[-1])
    scored = [{p for p in pairs if not set(p) <= hand} for pairs in found]
    assert [set(plant.touching(q)) for q in drawn] == scored


@pytest.mark.slow
def test_pairs_that_lose_the_shapes_followed_are_found_by_comparing_all(pr2, judge):
    whole, plant = judge, SelfCollision(pr2)
    first, *others = sample_positions(pr2, 6, seed=3)
    followed, lost = plant.touching(first), 0
    plant.follow(followed)
    for q in others:
        expected, found = whole.touching(q) & followed, plant.touching(q) & followed
        assert found <= expected
        plant.compare(followed - found)
        assert plant.touching(q) & followed == expected
        plant.follow(expected - found)
        lost += len(expected - found)
    assert lost


MIDDLE = 0.15
"""Height of the torso [m]."""


def postures(pr2, torso, count, seed):
    """Draw arm postures within soft limits, other joints as in the robot file."""
    rest = pr2.with_mimics(pr2.joint_positions()) | {pr2.torso_joint: torso}
    for sample in sample_positions(pr2, count, seed):
        yield rest | {name: sample[name] for name in pr2.arm_joints}


def checked(pr2, pairs, arm_bodies):
    """Return the pairs that scoring checks: an arm body, not disabled, not within the hand."""
    model = pr2.model()
    last = model.joints[pr2.arm_joints[-1]].child
    hand = {body for body in model.links if model.chain(last, body) is not None}
    off = {frozenset(pair) for pair in pr2.disabled_pairs}
    return {
        pair
        for pair in pairs
        if frozenset(pair) not in off and arm_bodies & set(pair) and not set(pair) <= hand
    }


def standing(pr2, pair):
    """Return a pair with "base" in the place of whatever is welded to the root."""
    model = pr2.model()
    return frozenset(
        "base" if welded_top(model, body)[0] == pr2.root_body else body for body in pair
    )


def test_samples_stay_within_limits_and_mimic(pr2):
    limits = pr2.joint_limits()
    for sample in sample_positions(pr2, 20, seed=0):
        for name in (*pr2.arm_joints, pr2.torso_joint):
            assert limits[name][0] <= sample[name] <= limits[name][1]
        assert sample["l_gripper_r_finger_joint"] == sample["l_gripper_l_finger_joint"]


@pytest.fixture(scope="module")
def touching(pr2, judge, hulls):
    """Random postures with the torso in the middle, and the pairs of shapes and of hulls that touch
    there."""
    return [(q, judge.touching(q), hulls.touching(q)) for q in postures(pr2, MIDDLE, 60, seed=4)]


# Measured over 2000 postures: 0.85, 0.89, 0.94; four standard errors of 60 are 0.18.
@pytest.mark.parametrize(
    ("torso", "share"), some_of([(0.0115, 0.85), (MIDDLE, 0.89), (0.3, 0.94)], (MIDDLE, 0.89))
)
def test_most_arm_postures_are_free(pr2, judge, touching, arm_bodies, torso, share):
    found = (
        [shapes for _, shapes, _ in touching]
        if torso == MIDDLE
        else [judge.touching(q) for q in postures(pr2, torso, 60, seed=3)]
    )
    free = [not checked(pr2, pairs, arm_bodies) for pairs in found]
    assert np.mean(free) == pytest.approx(share, abs=0.18)


def test_primitives_rarely_touch_where_hulls_do_not(pr2, touching, arm_bodies):
    false = [
        bool(checked(pr2, shapes, arm_bodies)) and not checked(pr2, hulls, arm_bodies)
        for _, shapes, hulls in touching
    ]
    # Measured 0.005 over 2000 postures.
    assert np.mean(false) <= 0.02


def test_contact_of_hulls_that_primitives_miss_is_no_contact_of_surfaces(pr2, touching, arm_bodies):
    """A hull fills hollows, above all that over the low front of the base; the surface does not."""
    surfaces = SurfaceDistance(pr2.model(), body_triangles(pr2.model()))
    seen = 0
    for q, shapes, hulls in touching:
        # The base's primitives enclose its wheels, too.
        ours = {standing(pr2, pair) for pair in shapes}
        for pair in checked(pr2, hulls, arm_bodies):
            if standing(pr2, pair) in ours:
                continue
            seen += 1
            assert surfaces.distance(pair, q) > 0.0005, pair
    assert seen > 0


@pytest.mark.parametrize(
    ("joints", "far"),
    [
        ((0.0, 1.29, 3.0, -2.1, 0.0, -0.1, 0.0), "torso_lift_link"),
        ((0.0, 1.29, 0.0, -0.15, 0.0, -1.99, 0.0), "base_link"),
    ],
    ids=["forearm folded into the torso", "hand down on the base"],
)
def test_contact_of_the_arm_with_the_body_is_detected(pr2, judge, arm_bodies, joints, far):
    q = pr2.with_mimics(pr2.joint_positions()) | {pr2.torso_joint: 0.0115}
    q |= dict(zip(pr2.arm_joints, joints, strict=True))
    found = checked(pr2, judge.touching(q), arm_bodies)
    assert any(body.endswith(far) for pair in found for body in pair), found


@pytest.mark.parametrize(
    "far", ["torso_lift_link", "base_link", "head_pan_link", "r_shoulder_pan_link"]
)
@pytest.mark.parametrize("part", ["forearm_link", "gripper_palm_link", "gripper_l_finger_link"])
def test_forearm_and_hand_are_checked_against_the_body(pr2, part, far):
    off = {frozenset(pair) for pair in pr2.disabled_pairs}
    assert frozenset((f"l_{part}", far)) not in off


def test_disabled_pairs_lie_few_joints_apart(pr2):
    model = pr2.model()
    for pair in pr2.disabled_pairs:
        assert len(free_joints(model, joints_between(model, *pair))) <= 3, pair


def test_surfaces_that_meet_are_found_to(pr2):
    # Guards the evidence: a search that found everything apart would prove nothing.
    surfaces = SurfaceDistance(pr2.model(), body_triangles(pr2.model()))
    assert surfaces.closest_approach(("l_forearm_link", "l_gripper_palm_link"), pr2, 0) < CLEAR


def test_pairs_that_cannot_meet_do_not(pr2):
    surfaces = SurfaceDistance(pr2.model(), body_triangles(pr2.model()))
    pair = ("l_forearm_link", "l_upper_arm_link")
    assert pair in pr2.disabled_pairs
    assert surfaces.closest_approach(pair, pr2, seed=7) >= CLEAR


def test_shoulder_and_laser_stay_apart(pr2):
    surfaces = SurfaceDistance(pr2.model(), body_triangles(pr2.model()))
    pair = ("l_shoulder_pan_link", "laser_tilt_mount_link")
    assert pair in pr2.disabled_pairs
    assert surfaces.closest_approach(pair, pr2.with_choices(limits="hard"), seed=3) >= 0.025


def test_bodies_welded_to_the_base_are_checked_with_it(tmp_path):
    """The base's primitives include a wall on it, which the arm can touch."""
    wall = (
        '<link name="wall"><visual><geometry><box size="0.1 0.4 0.6"/></geometry></visual></link>'
        '<joint name="wall_joint" type="fixed"><parent link="base"/><child link="wall"/>'
        '<origin xyz="0.25 0 1.1"/></joint>'
    )
    (tmp_path / "walled.urdf").write_text(urdf().replace("</robot>", f"{wall}</robot>"))
    draft = draft_robot(tmp_path / "walled.urdf", "tool")
    assert {shape.body for shape in draft.primitives} >= {"base", "arm2"}
    off = {frozenset(pair) for pair in draft.robot.disabled_pairs}
    assert frozenset(("base", "arm2")) not in off
    assert frozenset(("arm1", "arm2")) in off


@pytest.mark.slow
def test_processes_find_the_pairs_that_one_finds(tmp_path):
    (tmp_path / "made_up.urdf").write_text(urdf())
    draft = draft_robot(tmp_path / "made_up.urdf", "tool")
    # Shapes so fat that some touch although the surfaces stay apart.
    fat = tuple(shape.shrunk(-0.05) for shape in draft.primitives)
    write_draft(replace(draft, primitives=fat), tmp_path / "mine.yaml")
    robot = load_robot(tmp_path / "mine.yaml")
    alone = propose_disabled_pairs(robot, postures=30)
    assert [group.reason.split(":")[0] for group in alone] == ["neighbours", "cannot meet"]
    assert propose_disabled_pairs(robot, postures=30, jobs=2) == alone


@pytest.mark.slow
def test_shipped_pairs_are_what_the_search_finds(pr2):
    proposed = {group.reason: set(group.pairs) for group in propose_disabled_pairs(pr2)}
    # Others are found by hand.
    searched = ("neighbours", "cannot meet: within", "primitives overlap")
    found = [group for group in pr2.disabled_groups if group.reason.startswith(searched)]
    shipped = {group.reason: set(group.pairs) for group in found}
    assert proposed.keys() == shipped.keys()
    for reason, pairs in shipped.items():
        assert pairs <= proposed[reason]
    # Shapes that touch in a few postures of thousands may or may not do so among those drawn; a
    # pair that was not seen to touch is checked, which is the safe side.
    more = set().union(*proposed.values()) - set().union(*shipped.values())
    assert len(more) <= 3


@pytest.mark.slow
def test_postures_that_shapes_alone_block_are_counted(pr2):
    found = blocked_by_shapes(pr2, postures=25)
    assert found.blocked <= found.free <= 25
    # Measured on the triangles: 0.012 of 1,389.
    assert found.fraction < 0.1
    assert f"of {found.free} random postures" in found.text()
    # Without exemptions the shapes of neighbours block every posture.
    panda = load_robot("panda").model_copy(update={"disabled_groups": ()})
    bare = blocked_by_shapes(panda, postures=10)
    assert bare.free == 0


def test_the_wrist_of_stretch_passes_its_telescope():
    """Shapes around its collision meshes block 59 of 81 such postures."""
    found = blocked_by_shapes(load_robot("stretch"), postures=100)
    assert found.free > 70
    assert found.fraction < 0.05


def test_groups_made_by_hand_are_kept(pr2, monkeypatch):
    by_hand = DisabledGroup(
        reason="nested: their meshes overlap",
        limits="hard",
        pairs=(("base_link", "l_forearm_link"),),
    )
    neighbours = "neighbours: one joint connects them, and its limits keep them apart"
    old = DisabledGroup(reason=neighbours, pairs=(("base_link", "laser_tilt_mount_link"),))
    found = (
        DisabledGroup(
            reason=neighbours,
            # The pair of the group made by hand, the other way round, and one more.
            pairs=(("l_forearm_link", "base_link"), ("l_forearm_link", "l_wrist_flex_link")),
        ),
        DisabledGroup(
            reason="primitives overlap in each of 2000 postures: parts of one joint assembly",
            pairs=(("base_link", "l_forearm_link"),),
        ),
    )
    monkeypatch.setattr("tcs_shapes.disabled_pairs.propose_disabled_pairs", lambda _: found)
    kept, fresh = renewed_groups(pr2.model_copy(update={"disabled_groups": (old, by_hand)}))
    assert kept == by_hand
    # What the search found before is replaced, and a group that would be empty is left out.
    assert fresh == found[0].model_copy(
        update={"pairs": (("l_forearm_link", "l_wrist_flex_link"),)}
    )


class _Swollen(RobotFile):
    """A robot whose shapes protrude by 3 cm more."""

    def load_primitives(self):
        return tuple(shape.shrunk(-0.03) for shape in super().load_primitives())


def test_postures_that_shapes_alone_block_at_boxes_are_counted():
    """The shapes of the iiwa are its surface, so only shapes that protrude block any."""
    robot = load_robot("iiwa7")
    tight = blocked_at_boxes(robot, postures=30)
    assert (tight.blocked, tight.pairs) == (0, ())
    # Measured on the triangles: 2,357 of 2,744.
    assert 15 < tight.free < 30
    swollen = blocked_at_boxes(_Swollen(**robot.model_dump()), postures=30)
    assert swollen.free == tight.free
    assert swollen.blocked > 0
    assert all(other == "box" and body in robot.model().links for (body, other), _ in swollen.pairs)
    assert f"of {swollen.free} random postures" in swollen.text()
