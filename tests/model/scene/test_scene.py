"""The live scene: poses, contacts, and obstacles of the user's own."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from pydrake.geometry import Role

from tcs.errors import EnvironmentFileError, TcsError, UnknownNameError
from tcs.model.robots import load_robot
from tcs.model.scene import (
    EnvironmentFile,
    ErrorDistribution,
    ModelEntry,
    Obstacle,
    Scene,
    SceneSpec,
)
from tcs.model.scene.contacts import Group

# Elbow bent, hand in front of the shoulder: free of the robot itself.
REACHING = np.array([0.3, 0.2, 0.5, -1.2, 0.4, -0.8, 0.2])


@pytest.fixture(scope="module")
def small(wheelchair):
    """A robot of twenty shapes and the wheelchair."""
    return SceneSpec(load_robot("iiwa7"), wheelchair)


def with_changes(spec, **changes):
    return SceneSpec(spec.robot, spec.environment.model_copy(update=changes))


def test_the_base_carries_the_tool(scene):
    scene.set_arm(REACHING)
    X_BT = scene.tool_pose()
    scene.place_base(0.7, -0.4, 0.9)
    X_WB = scene.base_pose()
    np.testing.assert_allclose(X_WB.translation(), [0.7, -0.4, 0.0], atol=1e-15)
    np.testing.assert_allclose(X_WB.rotation().matrix()[:2, 0], [np.cos(0.9), np.sin(0.9)])
    # Two orders of multiplying the same transforms.
    np.testing.assert_allclose(
        scene.tool_pose().GetAsMatrix34(), (X_WB @ X_BT).GetAsMatrix34(), atol=1e-14
    )


def test_the_torso_stays_within_its_limits(scene):
    # The PR2's soft limits: 0.0115 and 0.305 m.
    assert scene.set_torso(0.0) == 0.0115
    low = scene.tool_pose().translation()
    assert scene.set_torso(0.15) == 0.15
    raised = scene.tool_pose().translation() - low
    np.testing.assert_allclose(raised, [0.0, 0.0, 0.15 - 0.0115], atol=1e-12)
    assert scene.set_torso(9.0) == 0.305


def test_arm_limits_are_the_soft_ones_in_the_order_of_the_arm(scene):
    lower, upper = scene.arm_limits
    # PR2, safety_controller of the URDF; forearm roll and wrist roll are continuous.
    np.testing.assert_allclose(lower[[0, 1, 3, 5]], [-0.5646018, -0.3536, -2.1213, -1.994])
    np.testing.assert_allclose(upper[[0, 1, 3, 5]], [2.1353982, 1.2963, -0.15, -0.1], rtol=1e-6)
    assert np.isinf(lower[[4, 6]]).all()
    assert np.isinf(upper[[4, 6]]).all()


@pytest.mark.parametrize("bad", [[0.0] * 6, [0.0] * 6 + [np.nan], [[0.0] * 7]])
def test_invalid_arm_positions_are_refused(scene, bad):
    with pytest.raises(TcsError, match="7 finite numbers"):
        scene.set_arm(bad)


@pytest.mark.parametrize("seed", range(5))
def test_jacobian_is_the_derivative_of_the_tool_pose(scene, seed):
    rng = np.random.default_rng(seed)
    scene.place_base(*rng.uniform(-1, 1, 3))
    scene.set_torso(rng.uniform(0.05, 0.3))
    q = rng.uniform(-2, 2, 7)
    scene.set_arm(q)
    J = scene.tool_jacobian()
    R_WT = scene.tool_pose().rotation().matrix()
    step = 1e-6
    for j in range(7):
        poses = []
        for sign in (1, -1):
            moved = q.copy()
            moved[j] += sign * step
            scene.set_arm(moved)
            poses.append(scene.tool_pose())
        R_dot = (poses[0].rotation().matrix() - poses[1].rotation().matrix()) / (2 * step)
        spin = R_dot @ R_WT.T
        speed = (poses[0].translation() - poses[1].translation()) / (2 * step)
        measured = [spin[2, 1], spin[0, 2], spin[1, 0], *speed]
        # Central differences: rounding 1e-16 / 1e-6, truncation 1e-12.
        np.testing.assert_allclose(J[:, j], measured, atol=1e-8)


def test_drake_checks_exactly_the_pairs_of_the_rule(scene, rng):
    inspector = scene.query_object().inspector()
    counts = {True: 0, False: 0}
    # A shape of each body with each of the others, and some of all shapes.
    shapes = list({part.body: part for part in scene.built.parts}.values())
    pairs = list(itertools.combinations(scene.built.parts, 2))
    some = [pairs[i] for i in rng.permutation(len(pairs))[:2000]]
    for a, b in (*itertools.combinations(shapes, 2), *some):
        checked = scene.built.rule.is_checked(a, b)
        assert checked == scene.built.rule.is_checked(b, a)
        # Shapes of one body never meet, whatever any filter says.
        if a.body != b.body:
            assert inspector.CollisionFiltered(a.geometry, b.geometry) == (not checked), (a, b)
        else:
            assert not checked
        counts[checked] += 1
    assert min(counts.values()) > 100


def test_what_is_checked(scene, pr2):
    rule = scene.built.rule
    disabled = {frozenset(pair) for pair in pr2.disabled_pairs}
    # The rule looks at the kind of a shape alone.
    of_kinds = {part.kind: part for part in scene.built.parts}.values()
    for a, b in itertools.combinations(of_kinds, 2):
        groups = {a.group, b.group}
        if groups == {Group.ENVIRONMENT} or groups == {Group.BODY}:
            expected = False
        elif groups == {Group.BODY, Group.ENVIRONMENT}:
            expected = "floor" not in (a.name, b.name)
        elif groups == {Group.ARM, Group.ENVIRONMENT}:
            expected = True
        elif groups == {Group.ARM}:
            expected = a.carrier != b.carrier and frozenset((a.name, b.name)) not in disabled
        else:
            expected = frozenset((a.name, b.name)) not in disabled
        assert rule.is_checked(a, b) == expected


def test_neighbours_in_the_arm_do_not_block_it(scene):
    # A neighbour overlaps at its joint in every posture, so checking it would block everything.
    scene.place_base(3.0, 3.0, 0.0)
    scene.set_torso(0.15)
    scene.set_arm(REACHING)
    assert scene.violations() == ()


def test_the_parts_of_the_robot_are_distinguished(scene):
    carriers = {part.name: (part.group, part.carrier) for part in scene.built.parts}
    assert carriers["base_link"] == (Group.BODY, 0)
    assert carriers["torso_lift_link"] == (Group.BODY, 1)
    assert carriers["r_forearm_link"] == (Group.BODY, 1)
    assert carriers["l_shoulder_pan_link"] == (Group.ARM, 1)
    assert carriers["l_upper_arm_link"] == (Group.ARM, 3)
    assert carriers["l_forearm_link"] == (Group.ARM, 5)
    assert carriers["l_gripper_l_finger_tip_link"] == (Group.ARM, 7)


def test_a_base_in_the_chair_is_a_violation_and_a_clear_base_is_none(scene):
    scene.set_arm(REACHING)
    scene.set_torso(0.15)
    scene.place_base(0.4, 0.0, 0.0)
    blocked = scene.violations()
    assert any(a == "base_link" and b.startswith("wheelchair::") for a, b, _ in blocked)
    assert [distance for _, _, distance in blocked] == sorted(d for _, _, d in blocked)
    scene.place_base(4.0, 0.0, 0.0)
    assert scene.violations() == ()


def test_required_clearance_is_margin_or_padding(scene):
    assert scene.required_clearance("l_forearm_link", "r_forearm_link") == 0.001
    assert scene.required_clearance("l_forearm_link", "person::head_center") == 0.0131
    with pytest.raises(UnknownNameError, match="person::head_center"):
        scene.required_clearance("l_forearm_link", "person::head_centre")


def test_each_margin_applies_to_its_pairs_alone(spec):
    environment = spec.environment.model_copy(update={"contact_margin": 0.02})
    wide = Scene(SceneSpec(spec.robot.model_copy(update={"self_margin": 0.03}), environment))
    assert wide.required_clearance("l_forearm_link", "r_forearm_link") == 0.03
    assert wide.required_clearance("l_forearm_link", "wheelchair::seat") == 0.02
    assert wide.required_clearance("base_link", "person::head_center") == 0.02


def test_violations_start_at_the_required_clearance(scene):
    # Move the base towards the chair from the front, up to the first violation.
    scene.set_arm(REACHING)
    closest = []
    for x in np.linspace(2.2, 1.5, 36):
        scene.place_base(x, 0.0, 0.0)
        hits = {(a, b) for a, b, _ in scene.violations()}
        for a, b, distance in scene.clearances(0.05):
            assert (distance < scene.required_clearance(a, b)) == ((a, b) in hits)
            closest.append(distance)
    # The path must go from clear to blocked, or the test would show nothing.
    assert min(closest) < 0 < max(closest)


def test_joints_of_the_environment_move_the_person(scene):
    head = scene.body_frame_pose("head").translation()
    np.testing.assert_allclose(head, [0.451, 0.0, 1.232], atol=1e-12)
    scene.set_joint("wheelchair_x", 0.02)
    scene.set_joint("person_y", 0.01)
    moved = scene.body_frame_pose("head").translation()
    np.testing.assert_allclose(moved - head, [0.02, -0.01, 0.0], atol=1e-12)


def test_unknown_joint_and_frame_get_the_nearest_name(scene):
    with pytest.raises(UnknownNameError, match="Did you mean 'head_tilt'"):
        scene.set_joint("head_tlt", 0.1)
    with pytest.raises(UnknownNameError, match=r"'wheelchair'.*Did you mean 'head'"):
        scene.body_frame_pose("haed")


def test_a_spec_is_a_value_that_builds_the_same_scene_anywhere(spec, scene):
    again = pickle.loads(pickle.dumps(spec))
    assert again == spec
    assert hash(again) == hash(spec)
    assert len({spec, again}) == 1
    other = Scene(again)
    other.set_arm(REACHING)
    scene.set_arm(REACHING)
    np.testing.assert_array_equal(
        other.tool_pose().GetAsMatrix34(), scene.tool_pose().GetAsMatrix34()
    )


def test_the_default_position_of_a_joint_comes_from_the_file(spec):
    scene = Scene(with_changes(spec, joints={"wheelchair_y": 0.3}))
    np.testing.assert_allclose(scene.body_frame_pose("head").translation()[1], 0.3, atol=1e-12)


SHELF = """<sdf version="1.9"><model name="any name">{static}
  <link name="board"><pose>0 0 {z} 0 0 0</pose>
    <collision name="top"><geometry>{shape}</geometry></collision></link>
  <link name="leg"><pose>0 0.2 {z} 0 0 0</pose>
    <collision name="post"><geometry><sphere><radius>0.03</radius></sphere></geometry></collision>
  </link>{joint}
</model></sdf>"""
BOARD = "<box><size>0.1 0.1 0.1</size></box>"
FIXED = "<joint name='glue' type='fixed'><parent>board</parent><child>leg</child></joint>"
STATIC = "<static>true</static><pose>5 5 5 0 0 0</pose>"


def obstacle_scene(spec, *obstacles):
    return Scene(with_changes(spec, obstacles=tuple(obstacles)))


def shape_poses(scene):
    return {part.name: scene.shape_pose(part) for part in scene.built.parts}


def test_a_box_of_the_users_own_blocks_the_arm(spec, scene):
    scene.place_base(3.0, 3.0, 0.0)
    scene.set_torso(0.15)
    scene.set_arm(REACHING)
    assert scene.violations() == ()
    where = scene.tool_pose().translation()
    box = Obstacle(name="table", box=(0.2, 0.5, 0.2), xyz=tuple(where), rpy_deg=(0, 0, 90))
    other = obstacle_scene(spec, box)
    other.restore(scene.positions())
    assert any(b == "table" for _, b, _ in other.violations())
    pose = shape_poses(other)["table"]
    np.testing.assert_allclose(pose.translation(), where, atol=1e-12)
    # Its long side is rotated from y to -x.
    np.testing.assert_allclose(pose.rotation().matrix()[:, 1], [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("static", "joint"),
    [("", FIXED), (STATIC, ""), (STATIC, FIXED)],
    ids=["jointed", "static", "static and jointed"],
)
def test_a_model_of_the_users_own_is_placed_by_the_environment_file(small, tmp_path, static, joint):
    path = tmp_path / "shelf.sdf"
    path.write_text(SHELF.format(static=static, z=0.2, shape=BOARD, joint=joint))
    turned = Obstacle(name="left shelf", file=str(path), xyz=(1, 2, 0.1), rpy_deg=(0, 0, 90))
    plain = Obstacle(name="shelf", file=str(path), xyz=(0, -3, 0))
    scene = obstacle_scene(small, turned, plain)
    poses = shape_poses(scene)
    for name, where in {
        "left shelf::top": [1, 2, 0.3],
        "left shelf::post": [0.8, 2, 0.3],
        "shelf::top": [0, -3, 0.2],
        "shelf::post": [0, -2.8, 0.2],
    }.items():
        np.testing.assert_allclose(poses[name].translation(), where, atol=1e-12)
    scene.place_base(0.0, -3.0, 0.0)
    assert any(b == "shelf::top" for _, b, _ in scene.violations())


@pytest.mark.parametrize(
    ("shape", "joint", "expected"),
    [
        ("<cylinder><radius>1</radius><length>1</length></cylinder>", FIXED, "a Cylinder.*Box"),
        (BOARD, "", r"2 links without a parent: board, leg"),
        (BOARD, FIXED + "</model><model name='b'><link name='l'/>", "'shelf'.*cannot be used|two"),
        ("<box><size>1</size></box>", FIXED, r"'shelf'.*cannot be used.*size"),
        (
            BOARD,
            FIXED + "<joint name='hang' type='revolute'><parent>world</parent>"
            "<child>board</child><axis><xyz>0 0 1</xyz></axis></joint>",
            "a joint connects the model to the world",
        ),
    ],
    ids=["cylinder", "loose link", "two models", "torn box", "hung"],
)
def test_a_model_that_cannot_be_used_is_refused_in_one_line(
    small, tmp_path, shape, joint, expected
):
    path = tmp_path / "shelf.sdf"
    path.write_text(SHELF.format(static="", z=0, shape=shape, joint=joint))
    with pytest.raises(EnvironmentFileError, match=expected) as caught:
        obstacle_scene(small, Obstacle(name="shelf", file=str(path)))
    assert "\n" not in str(caught.value)


def test_names_that_are_not_there_are_refused(small):
    environment = small.environment
    entry = ModelEntry(name="copy", file=environment.models[0].file, parent="person::hed")
    bends = {"person_x": ErrorDistribution(distribution="normal", std_deg=1.0)}
    for changes, expected in (
        ({"models": (*environment.models, entry)}, r"'copy': unknown parent 'person::hed'"),
        ({"padding": {"person::hed": 0.01}}, r"'padding': unknown link 'person::hed'"),
        ({"body_frames": {"head": "person::hed"}}, r"body frame 'head': unknown link"),
        ({"joints": {"bed_height": 0.1}}, r"'joints': unknown joint 'bed_height'"),
    ):
        with pytest.raises(UnknownNameError, match=expected):
            Scene(with_changes(small, **changes))
    with pytest.raises(EnvironmentFileError, match=r"'errors', joint 'person_x'.*prismatic.*'std'"):
        Scene(with_changes(small, errors=bends))
    twice = environment.models[0].model_copy(update={"name": "second chair"})
    with pytest.raises(EnvironmentFileError, match="'wheelchair_x' exists twice"):
        Scene(with_changes(small, models=(*environment.models, twice)))


def test_allowed_contacts_are_not_checked(spec):
    scene = Scene(spec, allowed_contacts=[("base_link", "wheelchair::foot plate left")])
    scene.place_base(1.3, 0.15, 0.0)
    names = {(a, b) for a, b, _ in scene.violations()}
    assert ("base_link", "wheelchair::foot plate left") not in names
    plain = Scene(spec)
    plain.restore(scene.positions())
    checked = {(a, b) for a, b, _ in plain.violations()}
    assert ("base_link", "wheelchair::foot plate left") in checked
    with pytest.raises(UnknownNameError, match="environment body 'person::hand'"):
        Scene(spec, allowed_contacts=[("base_link", "person::hand")])
    with pytest.raises(UnknownNameError, match="robot body 'person::neck_link'"):
        Scene(spec, allowed_contacts=[("person::neck_link", "base_link")])


def test_an_empty_environment(pr2, wheelchair):
    empty = EnvironmentFile(
        name="empty", title="", origin="", source="", grid=wheelchair.grid, floor=False
    )
    scene = Scene(SceneSpec(pr2, empty))
    assert {part.group for part in scene.built.parts} == {Group.ARM, Group.BODY}
    with pytest.raises(UnknownNameError, match="Known: none"):
        scene.body_frame_pose("head")


def test_the_floor_stops_the_arm_but_not_what_stands_on_it(scene):
    scene.place_base(4.0, 4.0, 0.0)
    floor = [part for part in scene.built.parts if part.name == "floor"]
    assert len(floor) == 1
    met = {a for a, b, _ in scene.clearances(3.0) if b == "floor"}
    arm = {part.name for part in scene.built.parts if part.group is Group.ARM}
    assert met == arm


def test_drake_prints_no_warning(spec, caplog):
    Scene(spec)
    assert caplog.records == []


def test_meshes_are_for_drawing_only(spec, scene):
    with_meshes = Scene(spec, meshes=True)
    inspector = with_meshes.built.scene_graph.model_inspector()
    plain = scene.built.scene_graph.model_inspector()
    shown = len(inspector.GetAllGeometryIds(Role.kIllustration))
    assert shown > len(plain.GetAllGeometryIds(Role.kIllustration)) + 30
    assert len(with_meshes.built.parts) == len(scene.built.parts)
    for each in (scene, with_meshes):
        each.place_base(1.2, 0.3, 3.0)
        each.set_arm(REACHING)
    assert with_meshes.clearances(0.5) == scene.clearances(0.5)
