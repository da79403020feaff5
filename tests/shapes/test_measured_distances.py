"""Tables of distances: no bound is above the distance of the surfaces, by two measurements."""

from __future__ import annotations

import logging
import re
import time
from dataclasses import replace

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import tcs.kernel.distances as kernel_distances
import tests.reference.pairs as reference_distances
from tcs.errors import RobotError
from tcs.model.robots import Primitive, load_robot
from tcs.model.robots.distances import (
    FARTHEST,
    NOTHING,
    UNIT,
    DistanceTable,
    body_surface,
    read_tables,
    source_digest,
    surface_distance,
    tables_in_force,
    write_tables,
)
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import surface_geometries
from tcs_shapes.blocked import packed
from tcs_shapes.clearance import carried_triangles
from tcs_shapes.measured_distances import ENOUGH, KEPT, ROUNDING, measured_table, table_pairs
from tcs_shapes.surface_pair import SurfacePair, coal_model, convex_hull
from tests.chosen import some_of

WITH_TABLES = ["panda", "ur5"]


@pytest.fixture(scope="module", params=WITH_TABLES)
def robot(request):
    return load_robot(request.param)


@pytest.fixture(scope="module")
def surfaces(robot):
    carried = carried_triangles(robot, model_with_extras(robot))
    return {
        t.pair: SurfacePair.of(robot, t.pair, carried, t.joints) for t in tables_in_force(robot)
    }


def box(x, y, z):
    """Return the twelve triangles of a box about the origin [m]."""
    return np.asarray(trimesh.creation.box((x, y, z)).triangles)


def drawn(robot, rng):
    """Return random joint angles within the hard limits [rad]."""
    limits = robot.with_choices(limits="hard").without_ranges.joint_limits()
    return {name: rng.uniform(*limits[name]) for name in robot.arm_joints}


def test_no_bound_is_above_the_distance_of_the_surfaces(robot, surfaces, rng):
    tables = tables_in_force(robot)
    assert tables
    choices = table_pairs(robot)
    assert all(table.joints in choices[table.pair] for table in tables)
    for table in tables:
        counts = np.zeros(2, int)
        for _ in range(150):
            at = drawn(robot, rng)
            bound = table.bound(at)
            distance = surfaces[table.pair].distance(*(at[name] for name in table.joints))
            assert bound <= distance
            counts += [bound > robot.self_margin, bound > robot.self_margin or distance < 0.004]
        # It is no bound that knows nothing.
        assert counts[0] > 0
        assert counts[1] > 0


def test_bounds_hold_by_a_measurement_that_shares_no_code(robot, rng):
    model = model_with_extras(robot)
    for table in tables_in_force(robot):
        seen = 0
        while seen < 4:
            at = drawn(robot, rng)
            bound = table.bound(at)
            if bound < 0.5e-3:
                continue
            seen += 1
            placed = []
            for body in table.pair:
                R, p = pose_in_root(model, body, at)
                placed.append(body_surface(robot, body) @ R.T + p)
            assert surface_distance(*placed, bound + 0.005) >= bound


def test_no_bound_between_corners_is_above_the_distance(robot, surfaces, rng):
    """In cells that only just show that the surfaces keep the margin."""
    for table in tables_in_force(robot):
        step = 2.0 * np.pi / np.array(table.corners.shape)
        known = table.corners.astype(float) * UNIT
        just = np.argwhere((known > robot.self_margin) & (known < robot.self_margin + 3e-4))
        shown = 0
        for corner in just[rng.permutation(len(just))[:150]]:
            angles = (corner + rng.uniform(-1.0, 1.0, 2)) * step
            bound = table.bound(dict(zip(table.joints, angles, strict=True)))
            assert bound <= surfaces[table.pair].distance(*angles)
            shown += bound >= robot.self_margin
        assert shown > 10


def test_corners_are_rounded_down(robot, surfaces, rng):
    for table in tables_in_force(robot):
        step = 2.0 * np.pi / np.array(table.corners.shape)
        # These were measured one by one.
        close = np.argwhere((table.corners > 0) & (table.corners * UNIT < ENOUGH - UNIT))
        for corner in close[rng.permutation(len(close))[:25]]:
            first, second = corner * step
            distance = surfaces[table.pair].distance(float(first), float(second))
            held = int(table.corners[tuple(corner)]) * UNIT
            assert distance - UNIT - 2.0 * ROUNDING <= held <= distance
            assert table.bound(dict(zip(table.joints, (first, second), strict=True))) == (
                pytest.approx(held, abs=1e-7)
            )


def test_all_that_read_corners_know_one_unit():
    assert UNIT == kernel_distances.UNIT == reference_distances.STEP
    assert FARTHEST == kernel_distances.FARTHEST == reference_distances.MOST
    assert NOTHING == kernel_distances.NOTHING


def test_the_surface_of_a_body_is_what_its_shapes_enclose(robot):
    carried = carried_triangles(robot, model_with_extras(robot))
    for body in {body for table in tables_in_force(robot) for body in table.pair}:
        mine, theirs = (
            np.unique(np.round(t.reshape(-1, 3), 9), axis=0)
            for t in (body_surface(robot, body), carried[body])
        )
        np.testing.assert_allclose(mine, theirs, atol=2e-9)


@pytest.mark.parametrize("gap", [0.0, 0.013, 0.2])
def test_distance_of_two_boxes(gap, rng):
    for _ in range(5):
        R = Rotation.random(rng=rng).as_matrix()
        first = box(0.1, 0.2, 0.3)
        second = box(0.05, 0.3, 0.1) + np.array([0.075 + gap, 0.03, -0.05])
        found = surface_distance(first @ R.T, second @ R.T, 0.1)
        assert found == pytest.approx(min(gap, 0.1), abs=1e-12)


def test_crossing_surfaces_have_no_distance(rng):
    first = box(0.1, 0.1, 0.1)
    for _ in range(10):
        R = Rotation.random(rng=rng).as_matrix()
        second = box(0.02, 0.02, 0.5) @ R.T + rng.uniform(-0.03, 0.03, 3)
        assert surface_distance(first, second, 0.1) == 0.0


def test_a_surface_within_another_has_no_distance(rng):
    """Its triangles cross none, but the body is inside the other one."""
    R = Rotation.random(rng=rng).as_matrix()
    outer, inner = box(0.3, 0.2, 0.2) @ R.T, box(0.02, 0.03, 0.01)
    assert surface_distance(outer, inner, 0.1) == surface_distance(inner, outer, 0.1) == 0.0
    # Beside a corner: within the box around the tilted one, outside its hull.
    corner = outer.reshape(-1, 3)[0]
    beside = inner * 0.1 + corner + 0.01 * corner / np.linalg.norm(corner)
    assert 0.0 < surface_distance(outer, beside, 0.1) < 0.011
    # A flat surface has no inside.
    plate = np.array([[[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]])
    assert surface_distance(plate, inner + np.array([0, 0, 0.02]), 0.1) == pytest.approx(0.015)


def boxes_on_two_joints():
    """Return a small box that turns about itself, beside a larger one that it goes around."""
    sizes, centres = ((0.1, 0.1, 0.1), (0.04, 0.04, 0.04)), (0.0, 0.085)
    placed = [box(*size) + np.array([x, 0.0, 0.0]) for size, x in zip(sizes, centres, strict=True)]
    shapes = [
        Primitive(
            body="any",
            kind="box",
            size=tuple(edge + 0.012 for edge in size),
            xyz=(x, 0.0, 0.0),
            quaternion=(1.0, 0.0, 0.0, 0.0),
        )
        for size, x in zip(sizes, centres, strict=True)
    ]
    up = np.array([0.0, 0.0, 1.0])
    return SurfacePair(
        pair=("wrist_1_link", "wrist_3_link"),
        joints=("wrist_2_joint", "wrist_3_joint"),
        is_swept=False,
        axes=tuple((np.array([x, 0.0, 0.0]), up) for x in centres),
        triangles=tuple(placed),
        models=tuple(map(coal_model, placed)),
        hulls=tuple(map(convex_hull, placed)),
        shapes=tuple(packed([shape]) for shape in shapes),
    )


@pytest.mark.slow
def test_a_table_is_measured_as_closely_as_its_cells(rng):
    loss = 1e-4
    pair = boxes_on_two_joints()
    table = measured_table(pair, load_robot("ur5"), loss)
    assert table.reach == pytest.approx((np.hypot(0.05, 0.05), np.hypot(0.02, 0.02)))
    lost = []
    for q in rng.uniform(-6.0, 6.0, (1000, 2)):
        bound = table.bound(dict(zip(table.joints, q, strict=True)))
        distance = pair.distance(*q)
        assert bound <= distance
        if KEPT < distance < ENOUGH and pair.shapes_touch(*q, 0.0):
            lost.append(distance - bound)
    # Where edges meet edges, the distance between corners exceeds what is interpolated.
    assert len(lost) > 50
    assert np.mean(lost) < 2.0 * loss + UNIT
    # None holds more than its corner, also those that were filled in blocks.
    known = np.argwhere(table.corners > 0)
    step = 2.0 * np.pi / np.array(table.corners.shape)
    for corner in known[rng.permutation(len(known))[:1000]]:
        assert table.corners[tuple(corner)] * UNIT <= pair.distance(*corner * step)


def test_a_body_within_another_has_no_distance():
    pair = boxes_on_two_joints()
    assert pair.distance(0.0, 0.0) == pytest.approx(0.015)
    for scales in ((1.0, 0.1), (0.1, 1.0)):
        triangles = tuple(
            scale * (t - t.mean(axis=(0, 1)))
            for scale, t in zip(scales, pair.triangles, strict=True)
        )
        inner = replace(
            pair,
            triangles=triangles,
            models=tuple(map(coal_model, triangles)),
            hulls=tuple(map(convex_hull, triangles)),
        )
        assert inner.distance(0.0, 0.0) == 0.0


def test_joints_of_pairs():
    choices = table_pairs(load_robot("ur5"))
    lift, elbow, *wrist = load_robot("ur5").arm_joints[1:]
    assert choices["pedestal", "shoulder_link"] == (("shoulder_pan_joint",) * 2,)
    assert choices["shoulder_link", "forearm_link"] == ((lift, elbow),)
    assert choices["forearm_link", "wrist_3_link"] == (tuple(wrist[:2]), tuple(wrist[1:]))
    assert ("upper_arm_link", "wrist_3_link") not in choices
    assert ("forearm_link", "upper_arm_link") not in choices


@pytest.mark.parametrize("choice", some_of([0, 1], 0))
def test_a_body_counts_as_what_it_sweeps(choice, rng):
    robot, pair = load_robot("ur5"), ("forearm_link", "wrist_3_link")
    model = model_with_extras(robot)
    carried = carried_triangles(robot, model)
    joints = table_pairs(robot)[pair][choice]
    surfaces = SurfacePair.of(robot, pair, carried, joints)
    assert surfaces.is_swept
    assert surfaces.shapes_touch(0.0, 0.0, 0.0)
    models, lost, clear = [coal_model(carried[body]) for body in pair], [], 0
    for _ in range(60):
        at = drawn(robot, rng)
        bound = surfaces.distance(*(at[name] for name in joints))
        first, second = (coal.Transform3s(*pose_in_root(model, body, at)) for body in pair)
        apart = coal.distance(
            models[0], first, models[1], second, coal.DistanceRequest(), coal.DistanceResult()
        )
        assert bound <= max(0.0, apart) + 1e-9
        lost.append(max(0.0, apart) - bound)
        clear += bound > robot.self_margin
    assert clear > 10
    if choice == 0:
        # The last link is round.
        assert np.median(lost) < 0.001


def table_of(corners, source="0"):
    return DistanceTable(
        pair=("forearm_link", "wrist_2_link"),
        joints=("wrist_1_joint", "wrist_2_joint"),
        reach=(0.2, 0.1),
        corners=np.array(corners, np.uint8),
        source=source,
    )


def test_a_bound_between_corners():
    table = table_of([[100, 100], [0, 50]])
    half, (first, second) = np.pi, table.joints
    assert table.bound({first: 0.0, second: 2.0 * half}) == pytest.approx(100 * UNIT)
    assert table.bound({first: -half, second: 0.0}) == NOTHING
    assert table.bound({first: 0.0, second: half / 2}) == NOTHING
    # Close to a corner, the square loses the curvature's share of the way to both of its ends.
    x, y = 1e-5 / half, 2e-5 / half
    square = (1.0 - x + x * y / 4.0) * (100 * UNIT) ** 2
    lost = sum(
        reach * (reach + FARTHEST) * half**2 * way * (1.0 - way)
        for reach, way in zip(table.reach, (x, y), strict=True)
    )
    assert 0.05 * square < lost < 0.5 * square
    bound = table.bound({first: -1e-5, second: 2e-5 - 2.0 * half})
    assert bound == pytest.approx(np.sqrt(square - lost), abs=1e-9)
    # Rounded angles may be those of the corner.
    assert table.bound({first: -1e-3, second: 1e-3}, 1e-3) == pytest.approx(100 * UNIT)


@pytest.mark.parametrize("counts", [(240, 140), (400, 1)], ids=["two joints", "one joint"])
def test_a_bound_holds_for_points_that_turn(counts, rng):
    """The distance of points, two at a time, is known without any mesh."""
    R_first, R_second = 0.06, 0.03
    axes = np.zeros(3), np.array([0.0, 0.05, 0.0])
    here = rng.uniform(-1.0, 1.0, (15, 3)) * np.array([0.042, 0.042, 0.01])
    there = axes[1] + rng.uniform(-1.0, 1.0, (15, 3)) * np.array([0.021, 0.021, 0.01])

    def distances(first, second):
        """Return the distances at one angle of the first joint and some of the second."""
        rolls = Rotation.from_rotvec(np.outer(second, [0.0, 0.0, 1.0])).as_matrix()
        turned = axes[1] + np.einsum("sij,pj->spi", rolls, there - axes[1])
        turned = turned @ Rotation.from_rotvec([0.0, 0.0, first]).as_matrix().T
        return np.linalg.norm(here[:, None, None] - turned, axis=3).min(axis=(0, 2))

    angles = [np.arange(count) * 2.0 * np.pi / count for count in counts]
    one = counts[1] == 1
    found = np.array([distances(i, np.zeros(1) if one else angles[1]) for i in angles[0]])
    corners = np.minimum(np.floor(found / UNIT), 255).astype(np.uint8)
    reach = (R_first, 0.0 if one else R_second)
    joints = ("wrist_1_joint", "wrist_1_joint" if one else "wrist_2_joint")
    table = replace(table_of([[0]]), corners=corners, reach=reach, joints=joints)
    lost = []
    for first, second in rng.uniform(-7.0, 7.0, (2000, 2)):
        bound = table.bound({joints[1]: second, joints[0]: first})
        true = distances(first, np.array([0.0 if one else second]))[0]
        assert bound <= true
        if true < FARTHEST:
            lost.append(true - bound)
    assert len(lost) > 100
    assert np.median(lost) < 2e-4


def test_tables_of_other_meshes_do_not_count(tmp_path, caplog):
    robot = load_robot("panda")
    tables = tables_in_force(robot)
    text = robot.urdf_path().read_text()
    longer = text.replace('xyz="0.088 0 0"', 'xyz="0.089 0 0"')
    assert longer != text
    (tmp_path / "panda.urdf").write_text(longer)
    with caplog.at_level(logging.WARNING):
        other = robot.model_copy(update={"urdf": str(tmp_path / "panda.urdf")})
        assert tables_in_force(other) == ()
    (record,) = caplog.records
    named = ", ".join(" / ".join(table.pair) for table in tables)
    assert f"the shapes alone decide on contact of {named}." in record.getMessage()
    pairs = tuple(table.pair for table in tables)
    off = robot.disabled_groups[0].model_copy(update={"pairs": pairs})
    assert tables_in_force(robot.model_copy(update={"disabled_groups": (off,)})) == ()
    assert tables_in_force(robot.model_copy(update={"distances": None})) == ()


def test_files_of_tables(tmp_path):
    tables = [table_of([[1, 2, 3]], "a"), table_of([[4], [255]], "b")]
    path = tmp_path / "made_distances.npz"
    write_tables(path, tables, "made up")
    for read, written in zip(read_tables(path), tables, strict=True):
        assert (read.pair, read.joints, read.reach, read.source) == (
            written.pair,
            written.joints,
            written.reach,
            written.source,
        )
        np.testing.assert_array_equal(read.corners, written.corners)
    content = path.read_bytes()
    for damaged in (content[:100], b"", b"PK" + bytes(50), content[:-30]):
        path.write_bytes(damaged)
        with pytest.raises(RobotError, match=r"made_distances\.npz"):
            read_tables(path)


@pytest.mark.parametrize(
    "wrong",
    [
        {"corners": np.ones((3, 4))},
        {"corners": np.ones(12, np.uint8)},
        {"corners": np.ones((0, 4), np.uint8)},
        {"reach": (0.1, -0.1)},
        {"reach": (0.1, np.nan)},
        {"reach": (0.1,)},
        {"pair": ("forearm_link",)},
        {"joints": ("wrist_1_joint", "wrist_2_joint", "wrist_3_joint")},
    ],
    ids=lambda wrong: " ".join(wrong),
)
def test_tables_that_are_none_are_refused(tmp_path, wrong):
    path = tmp_path / "made_distances.npz"
    write_tables(path, [replace(table_of([[1, 2]]), **wrong)], "made up")
    with pytest.raises(RobotError, match="is no file of distances, damaged"):
        read_tables(path)


@pytest.mark.parametrize(
    ("geometry", "same"),
    [
        ('<mesh filename="same.stl"/></geometry>', True),
        ('<mesh filename="other.stl"/></geometry>', False),
        ('<mesh filename="same.stl" scale="1 1 1.001"/></geometry>', False),
        ('<mesh filename="same.stl"/></geometry><origin xyz="0 0 0.001" rpy="0 0 0"/>', False),
        ('<mesh filename="same.stl"/></geometry><origin xyz="0 0 0" rpy="0 0 0.001"/>', False),
        ('<box size="0.1 0.1 0.1"/></geometry>', False),
    ],
    ids=["elsewhere", "other content", "scaled", "shifted", "rotated", "a box"],
)
def test_the_digest_is_of_what_meshes_hold_and_where_they_are(geometry, same, tmp_path):
    robot, pair = load_robot("ur5"), ("forearm_link", "wrist_2_link")
    text, name = robot.urdf_path().read_text(), "ur5/collision/wrist2.stl"
    mesh = next(
        g.mesh for g in surface_geometries(robot.model(), pair[1]) if str(g.mesh).endswith(name)
    )
    (tmp_path / "same.stl").write_bytes(mesh.read_bytes())
    (tmp_path / "other.stl").write_bytes(mesh.read_bytes() + bytes(1))
    (tmp_path / "ur5.urdf").write_text(
        re.sub(rf'<mesh filename="[^"]*{name}"/>\s*</geometry>', geometry, text)
    )
    other = robot.model_copy(update={"urdf": str(tmp_path / "ur5.urdf")})
    assert (source_digest(other, pair) == source_digest(robot, pair)) is same


def test_tables_do_not_count_once_a_mesh_has_changed(tmp_path):
    robot, pair, name = load_robot("ur5"), ("forearm_link", "wrist_2_link"), "wrist2.stl"
    mesh = next(
        g.mesh for g in surface_geometries(robot.model(), pair[1]) if str(g.mesh).endswith(name)
    )
    copy = tmp_path / name
    copy.write_bytes(mesh.read_bytes())
    text = robot.urdf_path().read_text()
    (tmp_path / "ur5.urdf").write_text(
        re.sub(rf'filename="[^"]*ur5/collision/{name}"', f'filename="{copy}"', text)
    )
    other = robot.model_copy(update={"urdf": str(tmp_path / "ur5.urdf")})
    time.sleep(0.2)  # what is read of a file that has just changed is not kept
    assert pair in {table.pair for table in tables_in_force(other)}
    triangle = copy.read_bytes()[-50:]
    copy.write_bytes(copy.read_bytes()[:-50] + triangle[12:24] + triangle[:12] + triangle[24:])
    assert pair not in {table.pair for table in tables_in_force(other)}


def test_the_digest_is_of_the_axes_of_joints(tmp_path):
    robot, pair = load_robot("ur5"), ("forearm_link", "wrist_2_link")
    text = robot.urdf_path().read_text()
    before, after = text.split('<joint name="wrist_2_joint" type="revolute">')
    turned = after.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 -1"/>', 1)
    assert turned != after
    (tmp_path / "ur5.urdf").write_text(
        f'{before}<joint name="wrist_2_joint" type="revolute">{turned}'
    )
    other = robot.model_copy(update={"urdf": str(tmp_path / "ur5.urdf")})
    assert source_digest(other, pair) != source_digest(robot, pair)


def test_the_digest_is_of_meshes_and_joints():
    robot = load_robot("ur5")
    pair = ("forearm_link", "wrist_2_link")
    assert source_digest(robot, pair) == source_digest(robot, pair)
    assert source_digest(robot, pair) != source_digest(robot, ("forearm_link", "wrist_1_link"))
    raised = robot.mount.model_copy(update={"xyz": (0.0, 0.0, 0.8)})
    assert source_digest(robot.model_copy(update={"mount": raised}), pair) != source_digest(
        robot, pair
    )
