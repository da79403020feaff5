"""Robots that ship against published figures: fingers, mounts, pedestals, the PR2's two arms."""

import csv
import itertools
import re
from dataclasses import replace
from pathlib import Path

import coal
import numpy as np
import pytest

from tcs.files.paths import data_folder
from tcs.model.robots import load_robot, read_urdf
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf import Joint
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles, geometry_triangles, place
from tcs_shapes.self_collision import SelfCollision, sample_positions

FOLDER = data_folder() / "models" / "robots"
BAXTER = "package://example-robot-data/robots/baxter_description/urdf/baxter.urdf"
PANDA = "package://example-robot-data/robots/panda_description/urdf/panda.urdf"


def published_joints():
    path = Path(__file__).parents[2] / "data" / "robot_joints.csv"
    with path.open(newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def numbers(row, *keys):
    return tuple(float(row[key]) for key in keys)


@pytest.mark.parametrize(
    ("name", "one", "other"),
    [
        ("pr2", "l_gripper_l_finger_link", "l_gripper_r_finger_link"),
        ("pr2_right", "r_gripper_l_finger_link", "r_gripper_r_finger_link"),
        ("tiago", "gripper_right_finger_link", "gripper_left_finger_link"),
        ("panda", "panda_leftfinger", "panda_rightfinger"),
        ("baxter", "l_gripper_l_finger_tip", "l_gripper_r_finger_tip"),
    ],
)
def test_fingers_open_along_the_tools_y(name, one, other):
    robot = load_robot(name)
    model, positions = model_with_extras(robot), robot.with_mimics(robot.joint_positions())
    R_T, _ = pose_in_root(model, robot.tool_frame, positions)
    centres = []
    for body in (one, other):
        R, p = pose_in_root(model, body, positions)
        shapes = [s for s in robot.load_primitives() if s.body == body]
        volumes = [s.volume for s in shapes]
        centres.append(p + R @ np.average([s.xyz for s in shapes], axis=0, weights=volumes))
    apart = R_T.T @ (centres[1] - centres[0])
    # Fingers are shaped alike to a millimetre; the roots of TIAGo's lie 2 cm beside each other.
    assert abs(apart[0]) < 0.002
    assert abs(apart[1]) > 0.04
    assert abs(apart[2]) < 0.025


def test_tiagos_tool_sits_behind_its_fingertips_as_the_pr2s_does():
    robot = load_robot("tiago")
    model = model_with_extras(robot)
    R_T, p_T = pose_in_root(model, robot.tool_frame, {})
    tips = []
    for shape in robot.load_primitives():
        if "finger" in shape.body:
            R, p = pose_in_root(model, shape.body, {})
            signs = np.array(list(itertools.product((-1, 1), repeat=3)))
            half = np.array(shape.size) / 2 * signs
            corners = p + (np.array(shape.xyz) + half @ shape.rotation.T) @ R.T
            tips.append(((corners - p_T) @ R_T)[:, 0].max())
    # The PR2's closed fingers end 0.019 m ahead; the boxes are rounded out by a millimetre.
    assert max(tips) == pytest.approx(0.019, abs=0.0015)


def test_tiagos_gripper_is_mounted_as_published():
    model, joints = model_with_extras(load_robot("tiago")), published_joints()
    for link, name in (
        ("gripper_link", "gripper_joint"),
        ("gripper_grasping_frame", "gripper_grasping_frame_joint"),
    ):
        ours, row = model.parent_joints[link], joints[name]
        assert ours.parent == row["parent"]
        assert ours.xyz == numbers(row, "x", "y", "z")
        # PAL writes a right angle as 1.5708.
        np.testing.assert_allclose(ours.rpy, numbers(row, "roll", "pitch", "yaw"), atol=1e-5)


def test_iiwa_has_the_published_joints():
    joints = read_urdf(FOLDER / "iiwa7.urdf").joints
    rows = [row for row in published_joints().values() if row["robot"] == "iiwa7"]
    assert len(rows) == 8
    for row in rows:
        joint = joints[row["name"]]
        assert (joint.type, joint.parent, joint.child) == (row["type"], row["parent"], row["child"])
        assert (joint.xyz, joint.rpy) == (
            numbers(row, "x", "y", "z"), numbers(row, "roll", "pitch", "yaw"),
        )  # fmt: skip
        if joint.is_movable:
            assert joint.axis == numbers(row, "axis_x", "axis_y", "axis_z")
            assert joint.hard == numbers(row, "lower", "upper")


def test_iiwa_is_as_long_as_in_its_data_sheet():
    """340, 400, 400 and 126 mm from the foot to the flange, the arm straight up."""
    robot = load_robot("iiwa7")
    model = model_with_extras(robot)
    foot = pose_in_root(model, "iiwa_link_0", {})[1][2]
    heights = [
        pose_in_root(model, link, {})[1][2] - foot
        for link in ("iiwa_link_2", "iiwa_link_4", "iiwa_link_6", "flange")
    ]
    # The figures of the model are rounded to half a millimetre.
    np.testing.assert_allclose(np.diff([0, *heights]), [0.34, 0.4, 0.4, 0.126], atol=6e-4)


def test_panda_is_that_of_the_package_on_a_pedestal():
    ours = read_urdf(FOLDER / "panda.urdf")
    original = read_urdf(resolve_uri(PANDA, Path()))
    assert {name: ours.joints[name] for name in original.joints} == dict(original.joints)
    for link, geometries in original.links.items():
        mine = [(g.mesh, g.xyz, g.rpy, g.size) for g in ours.links[link] if g.mesh]
        assert mine == [(g.mesh, g.xyz, g.rpy, g.size) for g in geometries if g.role == "visual"]
    assert set(ours.links) - set(original.links) == {"base_footprint", "mobile_base", "column"}


def test_baxter_is_that_of_the_package_on_the_floor():
    ours = read_urdf(FOLDER / "baxter.urdf")
    original = read_urdf(resolve_uri(BAXTER, Path()))
    kept = {name: joint for name, joint in original.joints.items() if joint.child in ours.links}
    for name, joint in kept.items():
        # Some fixed joints there name an axis, or a speed.
        idle = {} if joint.is_movable else {"axis": joint.axis, "velocity": joint.velocity}
        assert replace(ours.joints[name], **idle) == joint
    assert set(ours.joints) - set(kept) == {"base_joint"}
    for link in set(ours.links) - {"base_footprint"}:
        shown = [g for g in original.links[link] if g.role == "visual"]
        assert [(g.mesh, g.xyz, g.rpy, g.size) for g in ours.links[link]] == [
            (g.mesh, g.xyz, g.rpy, g.size) for g in shown
        ]
    # Whatever is left out shows no mesh.
    left_out = set(original.links) - set(ours.links)
    assert not any(g.mesh for link in left_out for g in original.links[link])
    lowest = body_triangles(ours)["pedestal"][..., 2].min() + ours.joints["base_joint"].xyz[2]
    assert 0 <= lowest < 0.002


def test_baxters_arm_is_checked_against_its_torso_and_pedestal():
    off = {frozenset(pair) for pair in load_robot("baxter").disabled_pairs}
    for part in ("upper_elbow", "lower_elbow", "upper_forearm", "lower_forearm", "wrist"):
        for trunk in ("torso", "pedestal", "right_upper_shoulder"):
            assert frozenset((f"left_{part}", trunk)) not in off


@pytest.mark.slow
def test_baxters_torso_leaves_most_arm_postures_free():
    """Shapes as wide as its handles would forbid twice as many postures."""
    robot = load_robot("baxter")
    hand = robot.model().links_moved_by(robot.arm_joints[-1])  # never checked within itself
    moved = {body for body in robot.model().links if body.startswith(("left_", "l_"))}
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    judge, standing = SelfCollision(robot), robot.joint_positions()
    free = 0
    for sample in sample_positions(robot, 300, seed=3):
        posture = standing | {name: sample[name] for name in robot.arm_joints}
        touching = judge.touching(posture)
        free += not any(
            frozenset(pair) not in off and moved & set(pair) and not set(pair) <= hand
            for pair in touching
        )
    # Measured 0.67 of 600; surfaces leave 0.72. Four standard errors of 300 are 0.11.
    assert free / 300 > 0.56


def swapped(text):
    """Return the name of the same part on the other side."""
    return re.sub(r"^[lr]_", lambda found: {"l_": "r_", "r_": "l_"}[found[0]], text)


def test_right_arm_is_the_left_one_in_a_mirror(pr2):
    right = load_robot("pr2_right")
    assert right.arm_joints == tuple(map(swapped, pr2.arm_joints))
    assert right.tool_frame == swapped(pr2.tool_frame)
    joints = right.model().joints
    for name in right.arm_joints:
        assert isinstance(joints[name], Joint)
        sides = [joints[swapped(name)], joints[name]]
        assert sides[1].xyz == pytest.approx([sides[0].xyz[0], -sides[0].xyz[1], sides[0].xyz[2]])
    # Pan and roll have the opposite sense in a mirror.
    turns = {"shoulder_pan", "upper_arm_roll", "forearm_roll", "wrist_roll"}
    for posture, positions in pr2.postures.items():
        mirrored = {
            swapped(name): -q if name[2:].removesuffix("_joint") in turns else q
            for name, q in positions.items()
        }
        assert right.postures[posture] == mirrored


def test_both_arms_have_the_same_disabled_pairs(pr2):
    right = load_robot("pr2_right")
    left = {frozenset(map(swapped, pair)) for pair in pr2.disabled_pairs}
    assert {frozenset(pair) for pair in right.disabled_pairs} == left


def bvh(triangles):
    """Return triangles as a model of Coal, which tests them exactly."""
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        points.append(corner)
    for a, b, c in index.reshape(-1, 3).tolist():
        faces.append(coal.Triangle(a, b, c))
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(points))
    model.addSubModel(points, faces)
    model.endModel()
    return model


def mesh_distances(robot, pair, postures):
    """Return the distances of two meshes in given postures [m], at most 0 if they cross."""
    model = robot.model()
    triangles = body_triangles(model)
    meshes = [bvh(triangles[body]) for body in pair]
    found = []
    for positions in postures:
        poses = [coal.Transform3s(*pose_in_root(model, body, positions)) for body in pair]
        placed = meshes[0], poses[0], meshes[1], poses[1]
        found.append(coal.distance(*placed, coal.DistanceRequest(), coal.DistanceResult()))
    return np.array(found)


def test_baxters_upper_elbow_and_upper_forearm_do_not_meet():
    """Their hulls overlap where the elbow is bent most."""
    robot = load_robot("baxter")
    pair = ("left_upper_elbow", "left_upper_forearm")
    assert pair in robot.disabled_pairs
    bent = robot.joint_limits()["left_e1"][1]
    turns = np.linspace(*robot.joint_limits()["left_w0"], 8)
    distances = mesh_distances(robot, pair, [{"left_e1": bent, "left_w0": w} for w in turns])
    # Measured 1.95 mm over 1,500 postures.
    assert distances.min() > 0.0015


def test_the_pr2s_wrist_grazes_its_forearm_in_the_middle_of_its_range_only(pr2):
    pair = ("l_forearm_link", "l_wrist_flex_link")
    angles = np.linspace(*pr2.with_choices(limits="hard").joint_limits()["l_wrist_flex_joint"], 106)
    distances = mesh_distances(pr2, pair, [{"l_wrist_flex_joint": q} for q in angles])
    crossing = angles[distances <= 0.0]
    assert len(crossing) > 10
    assert -0.6 < crossing.min() < crossing.max() < -0.24


def test_pandas_wrist_keeps_its_range_because_the_hand_is_checked_against_the_forearm():
    """The hand folded back meets link 5 below 0.24 rad of joint 6, at most angles of joint 7."""
    robot = load_robot("panda")
    assert robot.joint_limits() == robot.without_ranges.joint_limits()
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    fingers = ("panda_leftfinger", "panda_rightfinger")
    assert not off & {frozenset((body, "panda_link5")) for body in ("panda_hand", *fingers)}
    pair, judge = ("panda_hand", "panda_link5"), SelfCollision(robot)
    rest = robot.with_mimics(robot.joint_positions() | robot.rest)
    postures = [
        rest | {"panda_joint6": bend, "panda_joint7": turn}
        for bend in (0.0, 0.25, 0.45)
        for turn in np.linspace(*robot.joint_limits()["panda_joint7"], 5)
    ]
    distances = mesh_distances(robot, pair, postures)
    touching = np.array([tuple(sorted(pair)) in judge.touching(at) for at in postures])
    assert np.all(touching[distances < robot.self_margin])
    assert np.any(distances <= 0.0)
    # The boxes around both would touch up to 0.67 rad.
    assert not touching[-5:].any()


@pytest.mark.slow
def test_the_lift_of_stretch_comes_near_the_head_only_beyond_its_range():
    """It moves straight up, and is nearest at the end."""
    robot = load_robot("stretch")
    pairs = [("link_head", "link_lift"), ("link_lift", "respeaker_base")]
    assert set(pairs) <= set(robot.disabled_pairs)
    lower, upper = robot.joint_limits()["joint_lift"]
    _, end = robot.without_ranges.joint_limits()["joint_lift"]
    postures = [{"joint_lift": q} for q in (*np.linspace(lower, upper, 9), end)]
    for pair in pairs:
        assert mesh_distances(robot, pair, postures)[:-1].min() > robot.self_margin
    # The widest range to a millimetre.
    assert end - upper == pytest.approx(0.001)
    assert mesh_distances(robot, pairs[0], postures)[-1] < robot.self_margin


def test_shapes_of_stretch_are_as_large_as_the_parts_that_are_drawn():
    """Its collision meshes are boxes that exceed base and telescope by 8 and 10 mm."""
    robot = load_robot("stretch")
    shapes = robot.load_primitives()
    for body in ("base_link", *(f"link_arm_l{i}" for i in range(1, 5))):
        drawn = [g for g in robot.model().links[body] if g.role == "visual"]
        corners = np.concatenate(
            [place(geometry_triangles(g), g.xyz, g.rpy) for g in drawn]
        ).reshape(-1, 3)
        bounds = np.array([shape.bounds for shape in shapes if shape.body == body])
        # Across: the protrusion to which the base is fitted.
        assert np.all((bounds[:, 0].min(axis=0) > corners.min(axis=0) - 0.005)[:2])
        assert np.all((bounds[:, 1].max(axis=0) < corners.max(axis=0) + 0.005)[:2])


def test_the_wrist_of_jaco_folds_into_itself_only_beyond_its_range():
    robot = load_robot("jaco")
    joint, pair = "j2s6s200_joint_5", ("j2s6s200_link_4", "j2s6s200_link_5")
    assert pair in robot.disabled_pairs
    lower, upper = robot.joint_limits()[joint]
    assert (lower, upper) != robot.without_ranges.joint_limits()[joint]
    within = [{joint: q} for q in np.linspace(lower, upper, 9)]
    beyond = [{joint: q} for q in np.radians([31.0, 48.0, 312.0, 329.0])]
    distances = mesh_distances(robot, pair, [*within, *beyond])
    # The two seats of the joint are 0.13 mm apart.
    assert distances[: len(within)].min() > 1e-4
    assert distances[len(within) :].max() <= 0.0


def test_tiago_pros_first_link_crosses_the_fixed_torso_only_while_the_torso_is_low():
    """Below that height they cross at every angle: a check would forbid every posture."""
    robot = load_robot("tiago_pro").with_choices(limits="hard")
    pair, turn = ("arm_left_1_link", "torso_base_link"), "arm_left_1_joint"
    assert pair in robot.disabled_pairs
    turns = np.linspace(*robot.joint_limits()[turn], 7)
    _, highest = robot.model().joints[robot.torso_joint].hard
    low, high = (
        mesh_distances(
            robot, pair, [{turn: q, robot.torso_joint: z} for z in heights for q in turns]
        )
        for heights in ((0.0, 0.045, 0.085), (0.0905, 0.11, 0.15, highest))
    )
    assert low.max() <= 0.0
    assert high.min() > 0.0


@pytest.mark.parametrize(("name", "side"), [("pr2", "l"), ("pr2_right", "r")])
def test_shoulder_and_upper_arm_cross_only_beyond_the_range_of_the_lift(name, side):
    robot = load_robot(name)
    pair = (f"{side}_shoulder_pan_link", f"{side}_upper_arm_roll_link")
    lift, roll = f"{side}_shoulder_lift_joint", f"{side}_upper_arm_roll_joint"
    assert robot.joint_limits() == robot.without_ranges.joint_limits()  # the soft limits
    limits = robot.with_choices(limits="hard").joint_limits()
    rolls, lifts = np.linspace(*limits[roll], 9), np.linspace(*limits[lift], 5)
    clear = [{lift: angle, roll: q} for angle in lifts for q in rolls]
    assert mesh_distances(robot, pair, clear).min() > robot.self_margin
    # The widest range to two thousandths of a radian.
    close, beyond = (
        mesh_distances(robot, pair, [{lift: angle, roll: q} for q in rolls])
        for angle in (limits[lift][1] + 0.002, 1.36)
    )
    assert close.max() < robot.self_margin
    assert beyond.max() <= 0.0
