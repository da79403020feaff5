"""Bed and lying person against the published figures."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import Role
from scipy.spatial.transform import Rotation

from tcs.errors import TcsError
from tcs.model.grid import Grid
from tcs.model.scene.environment.environment_file import load_environment
from tests.chosen import some_of
from tests.model.scene.environments import EnvironmentAlone, numbers, rows

HEAD_RESTS = (0, 35, 70)
HINGE = np.array([0.755, 0.0, 0.541])
OUR_NAME = {"head_link": "head_center"}
"""The head's shapes are on a link of their own, so that the head can tilt alone."""


@pytest.fixture(scope="module")
def bed():
    return EnvironmentAlone("bed")


@pytest.fixture
def environment(bed):
    """The bed environment in the state of its file, before and after each test."""
    bed.set()
    yield bed
    bed.set()


def published_poses(head_rest_deg, bed_height):
    """Rotation and origin in W of every link, from joint frames and joint positions."""
    poses = {"base_link": (Rotation.identity(), np.zeros(3))}
    for row in rows("human_frames_bed.csv"):
        if int(row["headrest_deg"]) != head_rest_deg or row["joint_type"] == "root":
            continue
        R_WP, p_WP = poses[row["parent"]]
        p_WJ = p_WP + R_WP.apply(numbers(row, "jo_x", "jo_y", "jo_z"))
        R_WJ = R_WP * Rotation.from_quat(numbers(row, "jo_qx", "jo_qy", "jo_qz", "jo_qw"))
        position = float(row["q"] or 0.0)
        if row["joint"] == "tele_legs_joint":
            position = bed_height
        if row["joint_type"] == "prismatic":
            p_WJ = p_WJ + R_WJ.apply(position * numbers(row, "axis_x", "axis_y", "axis_z"))
        elif row["joint_type"] == "revolute":
            axis = numbers(row, "axis_x", "axis_y", "axis_z")
            R_WJ = R_WJ * Rotation.from_rotvec(position * axis)
        poses[row["link"]] = (R_WJ, p_WJ)
    return poses


@pytest.mark.parametrize("bed_height", [0.0, 0.2])
@pytest.mark.parametrize("head_rest_deg", HEAD_RESTS)
def test_body_frames_lie_where_the_original_had_them(environment, head_rest_deg, bed_height):
    environment.set(bed_height=bed_height, head_rest=np.radians(head_rest_deg))
    published = published_poses(head_rest_deg, bed_height)
    judged = set()
    for link, (R_WL, p_WL) in published.items():
        ours = f"person::{OUR_NAME.get(link, link)}"
        if ours not in environment.added.links or link == "base_link":
            continue
        judged.add(ours)
        X_WL = environment.added.links[ours].EvalPoseInWorld(environment.state)
        # Joint frames carry seven digits of a quaternion, over a body 1.7 m long; a wrong figure
        # would be off by more than a millimetre or a tenth of a degree.
        np.testing.assert_allclose(X_WL.translation(), p_WL, atol=1e-6, err_msg=link)
        turned = R_WL.inv() * Rotation.from_matrix(X_WL.rotation().matrix())
        assert turned.magnitude() < 1e-6, link
    assert judged >= set(environment.file.body_frames.values())
    assert len(environment.file.body_frames) == 17
    # The frame of our head rest lies on its hinge, as there.
    hinge = environment.added.links["bed::head_rest_link"].EvalPoseInWorld(environment.state)
    np.testing.assert_allclose(hinge.translation(), published["head_rest_link"][1], atol=1e-6)


def test_raising_the_bed_raises_all_except_feet_posts_and_wall(environment):
    still, raised = {}, {}
    for height, found in ((0.0, still), (0.3, raised)):
        environment.set(bed_height=height, head_rest=0.5)
        for part in environment.parts:
            found[part] = environment.query().GetPoseInWorld(part.geometry).GetAsMatrix34().copy()
    for part, before in still.items():
        stays = part.name in ("wall", "floor") or " post " in part.name or " disc " in part.name
        expected = before + (0.0 if stays else 0.3) * np.eye(3, 4, 3)[[1, 2, 0]]
        np.testing.assert_allclose(raised[part], expected, atol=1e-12, err_msg=part.name)


@pytest.mark.parametrize("head_rest_deg", [0, 20, 35, 70, 80])
def test_the_person_shifts_along_the_axes_of_w_whatever_the_head_rest_does(
    environment, head_rest_deg
):
    at = np.radians(head_rest_deg)
    slope = np.array([np.cos(at), 0.0, -np.sin(at)])
    for joint, direction in (
        ("person_x", np.array([1.0, 0.0, 0.0])),
        ("person_y", np.array([0.0, 1.0, 0.0])),
        # The original's own x: along the surface of the head rest, down.
        ("person_slide", slope),
    ):
        for link in environment.file.body_frames.values():
            X_WL = environment.pose(link, head_rest=at)
            shifted = environment.pose(link, head_rest=at, **{joint: 0.07})
            moved = shifted.translation() - X_WL.translation()
            np.testing.assert_allclose(moved, 0.07 * direction, atol=1e-12)
            np.testing.assert_allclose(
                shifted.rotation().matrix(), X_WL.rotation().matrix(), atol=1e-12
            )
        still = environment.pose("bed::head_rest_link", head_rest=at, **{joint: 0.07})
        np.testing.assert_allclose(still.translation(), HINGE, atol=1e-12)


def test_the_head_tilts_up_about_its_own_centre(environment):
    nominal = environment.pose("person::head_center", head_rest=0.6)
    tilted = environment.pose("person::head_center", head_rest=0.6, head_tilt=0.3)
    np.testing.assert_allclose(tilted.translation(), nominal.translation(), atol=1e-12)
    turned = nominal.rotation().inverse() @ tilted.rotation()
    face = turned.matrix()[:, 0]
    np.testing.assert_allclose(face, [np.cos(0.3), 0.0, np.sin(0.3)], atol=1e-12)
    for link in ("person::neck_link", "person::hand_left_link"):
        np.testing.assert_array_equal(
            environment.pose(link, head_rest=0.6, head_tilt=0.3).GetAsMatrix34(),
            environment.pose(link, head_rest=0.6).GetAsMatrix34(),
        )


def our_name(item):
    for there, here in (
        ("mattress, ", "mattress "),
        ("head foot", "head end foot"),
        ("foot foot", "foot end foot"),
    ):
        item = item.replace(there, here)
    return "wall" if item == "wall" else f"bed::{item}"


FURNITURE = [row for row in rows("furniture_bed.csv") if row["kind"] == "primitive"]


@pytest.mark.parametrize("row", FURNITURE, ids=lambda row: row["item"])
def test_furniture_is_where_the_mesh_is(environment, row):
    lowest, highest = environment.reach(our_name(row["item"]))
    if row["shape"] == "cylinder":
        centre, radius = numbers(row, "cx", "cy", "cz"), float(row["dim_a"])
        half = np.array([radius, radius, float(row["dim_b"]) / 2])
        lower, upper = centre - half, centre + half
    else:
        lower = numbers(row, "min_x", "min_y", "min_z")
        upper = numbers(row, "max_x", "max_y", "max_z")
    if "corner leg" in row["item"]:
        # Longer, so that at 0.3 m it still meets its post, which ends at 0.33.
        lower[2] = 0.03
        assert lower[2] + 0.3 <= 0.33
    # The figures have five digits.
    np.testing.assert_allclose(lowest, lower, atol=1e-5)
    np.testing.assert_allclose(highest, upper, atol=1e-5)


def test_nothing_of_the_bed_is_left_out_or_added(environment):
    ours = {part.name for part in environment.parts if not part.name.startswith("person::")}
    # The plates that brace beam and legs are ours: the published boxes leave them out.
    plates = {name for name in ours if " plate" in name}
    assert ours - plates == {our_name(row["item"]) for row in FURNITURE} | {"floor"}
    assert (len(FURNITURE), len(plates)) == (22, 6)


@pytest.mark.parametrize("head_rest_deg", HEAD_RESTS)
def test_the_head_section_rises_with_the_head_rest(environment, head_rest_deg):
    where = f" at {head_rest_deg} deg" if head_rest_deg else ""
    (row,) = [r for r in rows("furniture_bed.csv") if r["item"] == f"head_rest_link{where}"]
    environment.set(head_rest=np.radians(head_rest_deg))
    lowest, highest = environment.reach("bed::mattress head section", "bed::pillow")
    lower, upper = (numbers(row, *(f"{end}_{k}" for k in "xyz")) for end in ("min", "max"))
    # The pillow is a rounded bump in the mesh and its box has corners: 5 cm high, a third of it
    # flat, so 4 cm at most once it is tilted. The mattress itself agrees.
    assert np.all(lowest <= lower + 1e-4)
    assert np.all(highest >= upper - 1e-4)
    np.testing.assert_allclose(lowest, lower, atol=0.04)
    np.testing.assert_allclose(highest, upper, atol=0.04)


def test_the_lying_person_has_the_shapes_of_the_seated_one(environment):
    def shapes(alone):
        return [
            (part.name, repr(shape := alone.inspector.GetShape(part.geometry)), type(shape))
            for part in alone.parts
            if part.name.startswith("person::")
        ]

    def poses(alone):
        return [
            (part.name, alone.inspector.GetPoseInFrame(part.geometry).GetAsMatrix34())
            for part in alone.parts
            if part.name.startswith("person::")
        ]

    seated = EnvironmentAlone("wheelchair")
    assert sorted(shapes(environment), key=str) == sorted(shapes(seated), key=str)
    for link in environment.file.body_frames.values():
        ours, theirs = (
            [X for name, X in poses(alone) if name == link] for alone in (environment, seated)
        )
        # Quaternions of seven digits.
        np.testing.assert_allclose(ours, theirs, atol=1e-6)
    person = {name: pad for name, pad in seated.file.padding.items() if "person" in name}
    assert person.items() <= environment.file.padding.items()


@pytest.mark.parametrize("head_rest_deg", some_of(HEAD_RESTS, 35))
def test_padding_covers_the_skin(environment, head_rest_deg):
    environment.set(head_rest=np.radians(head_rest_deg))
    padding = environment.file.padding
    skin = environment.exposed_skin()
    # Otherwise the rest would pass by leaving everything out.
    assert len(skin) > 3000
    assert len({link for link, _ in skin}) == 17
    inward = dict.fromkeys(environment.file.body_frames.values(), -np.inf)
    for link, distances in skin:
        inward[link] = max(inward[link], min(distances.values()))
    assert {link: d for link, d in inward.items() if d > padding[link]} == {}
    outside = [
        (link, worst)
        for link, distances in skin
        if (worst := min(d - padding[other] for other, d in distances.items())) > 0
    ]
    assert outside == []


def test_the_bed_has_the_grid_shifts_and_errors_of_the_paper():
    environment = load_environment("bed")
    grid = Grid.from_spec(environment.grid)
    assert grid.shape == (4, 3, 41, 41, 4, 3)
    assert grid.size == 242_064
    assert [axis.name for axis in grid.environment_axes] == ["bed_height", "head_rest"]
    np.testing.assert_allclose(grid.axis("bed_height").values, [0, 0.1, 0.2, 0.3], atol=1e-15)
    np.testing.assert_allclose(np.degrees(grid.axis("head_rest").values), HEAD_RESTS, atol=1e-12)
    assert grid.axis("base_x").values[[0, -1]].tolist() == [-2.0, 2.0]
    (shifts,) = environment.observed_axes
    assert shifts.name == "person_y"
    np.testing.assert_allclose(shifts.values, [-0.1, -0.05, 0, 0.05, 0.1], atol=1e-15)
    # TCS Table II.
    deviations = {name: e.standard_deviation for name, e in environment.errors.items()}
    assert deviations == {"person_x": 0.05, "person_y": 0.05}


def test_the_bed_without_wall_differs_by_the_wall_alone(environment):
    free = EnvironmentAlone("bed-no-wall")
    names = [part.name for part in environment.parts]
    names.remove("wall")
    assert [part.name for part in free.parts] == names
    changed = {"name", "title", "obstacles"}
    assert free.file.model_dump(exclude=changed) == environment.file.model_dump(exclude=changed)
    lowest, highest = environment.reach("wall")
    np.testing.assert_allclose([lowest, highest], [[-0.08, -1.5, 0], [-0.07, 1.5, 2]], atol=1e-12)


def test_joints_go_as_far_as_the_bed_does(environment):
    joints = environment.added.joints
    assert joints.limits("bed_height") == pytest.approx((0.0, 0.3))
    assert np.degrees(joints.limits("head_rest")) == pytest.approx((0.0, 80.0))
    with pytest.raises(TcsError, match=r"joint 'head_rest': 105 deg is beyond .* 0 to 80 deg"):
        environment.set(head_rest=np.radians(105))


def test_models_load_without_a_warning_from_drake(caplog):
    EnvironmentAlone("bed")
    assert caplog.records == []


def test_pictures_show_what_is_checked(environment):
    for link, body in environment.added.links.items():
        frame = environment.plant.GetBodyFrameIdOrThrow(body.index())
        checked, shown = (
            {
                (
                    repr(environment.inspector.GetShape(g)),
                    tuple(environment.inspector.GetPoseInFrame(g).GetAsMatrix34().ravel()),
                )
                for g in geometries
            }
            for geometries in (
                environment.plant.GetCollisionGeometriesForBody(body),
                environment.inspector.GetGeometries(frame, Role.kIllustration),
            )
        )
        assert shown == checked, link
