"""The lowered arrays against the Drake plant that they were read from."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections import defaultdict

import numpy as np
import pytest

from tcs.errors import UnknownNameError
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.model.grid import Grid
from tcs.model.scene import Obstacle, Scene, SceneSpec, goal_poses, lower
from tcs.model.scene.contacts import Group
from tcs.model.tasks import Goal

# A few dozen products of rotations, each rounded to 1e-16, over lengths of a few metres.
EXACT = 1e-12


def rotation_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def link_poses(chain, q):
    """Return X_AL1..X_AL7 and X_AT, as the kernel's arrays define them."""
    R, p = np.eye(3), np.zeros(3)
    poses = []
    for i in range(8):
        p = p + R @ chain.p[i]
        R = R @ chain.R[i]
        if i < 7:
            R = R @ rotation_z(q[i])
        poses.append((R, p))
    return poses


def of_group(scene, group):
    return [part for part in scene.built.parts if part.group is group]


def assert_same_pose(R, p, X):
    np.testing.assert_allclose(R, X.rotation().matrix(), atol=EXACT)
    np.testing.assert_allclose(p, X.translation(), atol=EXACT)


@pytest.mark.parametrize("seed", range(10))
def test_arrays_put_every_shape_and_the_tool_where_drake_does(scene, lowered, full_grid, seed):
    rng = np.random.default_rng(seed)
    arrays = lowered.arrays
    level = int(rng.integers(full_grid.axis("torso").count))
    x, y, yaw = rng.uniform(-2, 2, 3)
    q = rng.uniform(-np.pi, np.pi, 7)
    scene.place_base(x, y, yaw)
    scene.set_torso(full_grid.axis("torso").values[level])
    scene.set_arm(q)

    R_WB, p_WB = rotation_z(yaw), np.array([x, y, 0.0])
    R_WA = R_WB @ arrays.arm_base_R[level]
    p_WA = p_WB + R_WB @ arrays.arm_base_p[level]
    links = [(R_WA @ R, p_WA + R_WA @ p) for R, p in link_poses(arrays.chain, q)]
    assert_same_pose(*links[7], scene.tool_pose())
    for i, part in enumerate(of_group(scene, Group.ARM)):
        R_WL, p_WL = links[arrays.arm.frame[i] - 1]
        R_WG, p_WG = R_WL @ arrays.arm.R[0, i], p_WL + R_WL @ arrays.arm.p[0, i]
        assert_same_pose(R_WG, p_WG, scene.shape_pose(part))
    for i, part in enumerate(of_group(scene, Group.BODY)):
        R_WG = R_WB @ arrays.body.R[level, i]
        p_WG = p_WB + R_WB @ arrays.body.p[level, i]
        assert_same_pose(R_WG, p_WG, scene.shape_pose(part))
    for i, part in enumerate(of_group(scene, Group.ENVIRONMENT)):
        X_WG = scene.shape_pose(part)
        assert_same_pose(arrays.environment.R[0, i], arrays.environment.p[0, i], X_WG)


def test_each_joint_rotates_the_link_that_drake_rotates(scene, lowered):
    # Rotation of joint i alone must move the links beyond it and no others.
    for i in range(7):
        q = np.zeros(7)
        q[i] = 0.5
        scene.set_arm(q)
        for part in of_group(scene, Group.ARM):
            body = scene.built.plant.get_body(part.body)
            X_AB = body.body_frame().CalcPose(scene.plant_context, scene.built.arm_base_frame)
            turned = X_AB.rotation().matrix()
            scene.set_arm(np.zeros(7))
            X_AB = body.body_frame().CalcPose(scene.plant_context, scene.built.arm_base_frame)
            scene.set_arm(q)
            still = np.allclose(turned, X_AB.rotation().matrix(), atol=EXACT)
            assert still == (part.carrier <= i), (part.name, i)


def test_the_pr2_has_a_shoulder_and_a_wrist_that_meet(lowered):
    # The PR2's upper arm is 0.4 m and its forearm 0.321 m long (its URDF).
    p = lowered.arrays.chain.p
    np.testing.assert_array_equal(p[[2, 5, 6]], np.zeros((3, 3)))
    np.testing.assert_allclose(np.linalg.norm(p[[3, 4]], axis=1), [0.4, 0.321], atol=EXACT)


def test_the_gripper_is_one_body_with_the_last_link(lowered):
    names = np.array(lowered.robot_bodies)[lowered.arrays.arm.body]
    gripper = {name for name in names if "gripper" in name}
    assert len(gripper) == 5
    assert set(lowered.arrays.arm.frame[[name in gripper for name in names]]) == {7}


def test_shapes_are_drakes_own(scene, lowered):
    inspector = scene.built.scene_graph.model_inspector()
    kinds = {"Sphere": SPHERE, "Capsule": CAPSULE, "Box": BOX}
    for group, shapes in (
        (Group.ARM, lowered.arrays.arm),
        (Group.BODY, lowered.arrays.body),
        (Group.ENVIRONMENT, lowered.arrays.environment),
    ):
        parts = of_group(scene, group)
        assert len(parts) == len(shapes.type)
        for i, part in enumerate(parts):
            shape = inspector.GetShape(part.geometry)
            assert shapes.type[i] == kinds[type(shape).__name__]
            if shapes.type[i] == BOX:
                size = [shape.width() / 2, shape.depth() / 2, shape.height() / 2]
            elif shapes.type[i] == CAPSULE:
                size = [shape.radius(), shape.length() / 2, 0.0]
            else:
                size = [shape.radius(), 0.0, 0.0]
            assert shapes.size[i].tolist() == size
    assert {CAPSULE, BOX} <= set(lowered.arrays.environment.type)


def test_names_and_paddings_belong_to_the_right_shapes(scene, lowered, wheelchair):
    arrays = lowered.arrays
    for shapes, names, group in (
        (arrays.arm, lowered.robot_bodies, Group.ARM),
        (arrays.body, lowered.robot_bodies, Group.BODY),
        (arrays.environment, lowered.environment_bodies, Group.ENVIRONMENT),
    ):
        assert [names[i] for i in shapes.body] == [part.name for part in of_group(scene, group)]
    assert len(set(lowered.robot_bodies)) == len(lowered.robot_bodies)
    padding = {
        lowered.environment_bodies[i]: pad
        for i, pad in zip(arrays.environment.body, arrays.environment.pad, strict=True)
    }
    assert padding["person::head_center"] == wheelchair.padding["person::head_center"]
    assert padding["wheelchair::seat"] == wheelchair.padding["wheelchair::base_link"]
    assert padding["floor"] == 0.0
    assert not arrays.arm.pad.any()
    assert arrays.margin == wheelchair.contact_margin
    assert arrays.self_margin == 0.001
    # A user reads these: parts of the chair one by one, parts of the body as a whole.
    assert "wheelchair::rear wheel left" in lowered.environment_bodies
    assert sum(name.startswith("person::") for name in lowered.environment_bodies) == 17


def test_the_pairs_are_those_that_drake_checks(scene, lowered, rng):
    inspector = scene.query_object().inspector()
    arrays = lowered.arrays
    # Drake checks all shapes of two kinds or none: the tests of scenes compare each pair.
    kinds = {group: defaultdict(list) for group in Group}
    for group, of_kind in kinds.items():
        for i, part in enumerate(of_group(scene, group)):
            of_kind[part.kind].append((i, part))
    for first, second, matrix in (
        (Group.ARM, Group.ARM, arrays.arm_vs_arm),
        (Group.ARM, Group.BODY, arrays.arm_vs_body),
        (Group.ARM, Group.ENVIRONMENT, arrays.arm_vs_environment),
        (Group.BODY, Group.ENVIRONMENT, arrays.body_vs_environment),
    ):
        assert matrix.shape == (len(of_group(scene, first)), len(of_group(scene, second)))
        assert matrix.any()
        for those, others in itertools.product(kinds[first].values(), kinds[second].values()):
            block = matrix[np.ix_([i for i, _ in those], [j for j, _ in others])]
            (_, a), (_, b) = (of_kind[rng.integers(len(of_kind))] for of_kind in (those, others))
            filtered = a.body == b.body or inspector.CollisionFiltered(a.geometry, b.geometry)
            assert (block == (not filtered)).all(), (a.name, b.name)
    np.testing.assert_array_equal(arrays.arm_vs_arm, arrays.arm_vs_arm.T)


def test_goals_move_with_the_body(scene, lowered, shaving):
    X_WH = scene.body_frame_pose("head")
    for i, (goal, X_WG) in enumerate(zip(shaving.goals, goal_poses(scene, shaving), strict=True)):
        assert_same_pose(lowered.arrays.goal_R[0, i], lowered.arrays.goal_p[0, i], X_WG)
        np.testing.assert_allclose(X_WG.translation(), X_WH @ goal.position, atol=EXACT)
        # Where the tool's x points, straight from the quaternion (wxyz).
        w, x, y, z = goal.quaternion
        forward = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]
        np.testing.assert_allclose(
            X_WG.rotation().matrix()[:, 0], X_WH.rotation() @ np.array(forward), atol=EXACT
        )
    assert lowered.goals == tuple(f"shaving {i}" for i in range(8))


def test_the_grid_is_the_papers(lowered):
    grid = lowered.grid
    assert grid.environment_states == 1
    assert (len(grid.base_x), len(grid.base_y), len(grid.base_yaw)) == (61, 61, 8)
    assert grid.torso_levels == 3
    np.testing.assert_array_equal(np.degrees(grid.base_yaw).round(9), np.arange(8) * 45.0)
    assert lowered.arrays.arm_base_p.shape == (3, 3)
    # Torso 0 is below the PR2's soft limit, 0.0115 m.
    np.testing.assert_allclose(
        np.diff(lowered.arrays.arm_base_p[:, 2]), [0.15 - 0.0115, 0.15], atol=EXACT
    )


def test_an_axis_of_the_environment_moves_its_joint(scene, shaving, wheelchair):
    tilts = {"unit": "deg", "start": -10, "step": 10, "count": 3}
    shifts = {"unit": "m", "start": 0, "step": 0.1, "count": 2}
    grid = Grid.from_spec({"head_tilt": tilts, "wheelchair_y": shifts, **wheelchair.grid})
    arrays = lower(scene, shaving, grid).arrays
    assert arrays.environment.p.shape[0] == arrays.goal_p.shape[0] == 6
    for state, (tilt, shift) in enumerate(itertools.product(np.radians([-10, 0, 10]), [0.0, 0.1])):
        scene.set_joint("head_tilt", tilt)
        scene.set_joint("wheelchair_y", shift)
        for i, part in enumerate(of_group(scene, Group.ENVIRONMENT)):
            X_WG = scene.shape_pose(part)
            assert_same_pose(arrays.environment.R[state, i], arrays.environment.p[state, i], X_WG)
        for i, X_WG in enumerate(goal_poses(scene, shaving)):
            assert_same_pose(arrays.goal_R[state, i], arrays.goal_p[state, i], X_WG)
    unknown = Grid.from_spec({"bed_height": shifts, **wheelchair.grid})
    with pytest.raises(UnknownNameError, match="environment axis 'bed_height'"):
        lower(scene, shaving, unknown)


def test_lowering_leaves_the_scene_as_it_was(scene, shaving, full_grid, rng):
    scene.place_base(*rng.uniform(-1, 1, 3))
    scene.set_arm(rng.uniform(-1, 1, 7))
    scene.set_joint("person_x", 0.02)
    before = scene.positions()
    moved = lower(scene, shaving, full_grid)
    np.testing.assert_array_equal(scene.positions(), before)
    # Lowering reads the environment's joints as they are set: live mode depends on it.
    assert moved.arrays.goal_p[0, 0, 0] == pytest.approx(
        goal_poses(scene, shaving)[0].translation()[0], abs=EXACT
    )


def test_an_unknown_body_frame_names_task_goal_and_environment(scene, shaving, full_grid):
    goals = list(shaving.goals)
    goals[3] = Goal("haed", goals[3].position, goals[3].quaternion)
    task = dataclasses.replace(shaving, goals=tuple(goals))
    expected = "task 'shaving', goal 4, environment 'wheelchair': unknown frame 'haed'.*'head'"
    with pytest.raises(UnknownNameError, match=expected):
        lower(scene, task, full_grid)


def test_contacts_that_a_task_allows_are_not_checked(scene, shaving, full_grid, lowered):
    pair = ("l_gripper_l_finger_tip_link", "person::head_center")
    allowing = lower(scene, dataclasses.replace(shaving, allowed_contacts=(pair,)), full_grid)
    changed = allowing.arrays.arm_vs_environment != lowered.arrays.arm_vs_environment
    for i, j in zip(*np.nonzero(changed), strict=True):
        assert allowing.robot_bodies[allowing.arrays.arm.body[i]] == pair[0]
        assert allowing.environment_bodies[allowing.arrays.environment.body[j]] == pair[1]
    assert changed.any()
    assert not allowing.arrays.arm_vs_environment[changed].any()
    wrong = dataclasses.replace(shaving, allowed_contacts=(("l_finger", "person::head_center"),))
    with pytest.raises(UnknownNameError, match=r"task 'shaving'.*robot body 'l_finger'"):
        lower(scene, wrong, full_grid)


def test_the_digest_changes_with_what_is_scored_and_with_nothing_else(
    spec, scene, shaving, full_grid, lowered
):
    scene.place_base(0.3, 0.1, 1.0)
    assert lower(scene, shaving, full_grid).digest() == lowered.digest()
    digests = {lowered.digest()}
    for xyz in ((2.0, 0.0, 0.5), (2.0, 0.0, 0.501)):
        box = Obstacle(name="table", box=(0.5, 0.5, 0.5), xyz=xyz)
        environment = spec.environment.model_copy(update={"obstacles": (box,)})
        other = Scene(SceneSpec(spec.robot, environment))
        digests.add(lower(other, shaving, full_grid).digest())
    fewer = dataclasses.replace(shaving, goals=shaving.goals[1:])
    digests.add(lower(scene, fewer, full_grid).digest())
    short = full_grid.overridden({"base_x": {"count": 60}})
    digests.add(lower(scene, shaving, short).digest())
    assert len(digests) == 5
    assert all(len(digest) == 64 for digest in digests)


def leaves(item, path=()):
    """Yield the names that lead to each array or number of nested named tuples."""
    if isinstance(item, tuple):
        for name in item._fields:
            yield from leaves(getattr(item, name), (*path, name))
    else:
        yield path


def changed(item, path):
    """Return nested named tuples of which one array or number is another."""
    if not path:
        array = np.asarray(item)
        return ~array if array.dtype == np.bool_ else array + array.dtype.type(1)
    name, *rest = path
    return item._replace(**{name: changed(getattr(item, name), rest)})


def test_the_digest_changes_with_every_part(lowered):
    digest, same = lowered.digest(), []
    for part in ("arrays", "grid"):
        whole = getattr(lowered, part)
        for path in leaves(whole):
            other = dataclasses.replace(lowered, **{part: changed(whole, path)})
            if np.size(functools.reduce(getattr, path, whole)) and other.digest() == digest:
                same.append(path)
    assert same == []


def test_the_arrays_cannot_be_written_to(lowered):
    for array in (lowered.arrays.chain.p, lowered.arrays.environment.R, lowered.grid.base_x):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
