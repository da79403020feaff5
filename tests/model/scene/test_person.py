"""Wheelchair and person against the published figures."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import Role
from pydrake.math import RigidTransform, RotationMatrix
from scipy.spatial.transform import Rotation

from tests.model.scene.environments import EnvironmentAlone, numbers, rows


@pytest.fixture(scope="module")
def environment():
    return EnvironmentAlone("wheelchair")


@pytest.mark.parametrize("row", rows("human_frames_chair.csv"), ids=lambda row: row["link"])
def test_body_frames_lie_where_the_original_had_them(environment, row):
    X_WL = environment.pose(f"person::{row['link']}")
    p_WL = numbers(row, "w_x", "w_y", "w_z")
    R_WL = Rotation.from_quat(numbers(row, "w_qx", "w_qy", "w_qz", "w_qw"))
    # The rows are rounded to a micrometre and seven digits of a quaternion; a wrong figure would
    # be off by more than a millimetre or a tenth of a degree.
    np.testing.assert_allclose(X_WL.translation(), p_WL, atol=1e-6)
    turned = R_WL.inv() * Rotation.from_matrix(X_WL.rotation().matrix())
    assert turned.magnitude() < 1e-6
    if row["jo_x"]:
        X_WP = environment.pose(f"person::{row['parent']}")
        X_PL = RigidTransform(
            RotationMatrix(
                Rotation.from_quat(numbers(row, "jo_qx", "jo_qy", "jo_qz", "jo_qw")).as_matrix()
            ),
            numbers(row, "jo_x", "jo_y", "jo_z"),
        )
        np.testing.assert_allclose((X_WP @ X_PL).GetAsMatrix34(), X_WL.GetAsMatrix34(), atol=1e-12)


def test_every_body_part_can_be_named_by_a_goal(environment):
    frames = environment.file.body_frames
    parts = {f"person::{row['link']}" for row in rows("human_frames_chair.csv")}
    not_parts = {f"person::{n}_link" for n in ("body_th_move", "body_x_move", "body_y_move")}
    assert set(frames.values()) == parts - not_parts - {"person::base_link"}
    assert len(frames) == 17
    assert frames["head"] == "person::head_center"


@pytest.mark.parametrize(
    ("item", "lower", "upper"),
    [
        # hrl_base_selection's wheelchair mesh: each part's extent in the world, or, for wheels,
        # the box around the cylinder (centre -+ radius).
        ("rear wheel left", (0.0, 0.2775, 0.0), (0.61, 0.3325, 0.61)),
        ("front wheel right", (0.625, -0.3075, 0.0), (0.885, -0.2375, 0.26)),
        ("seat", (0.28, -0.2775, 0.46), (0.725, 0.2775, 0.47)),
        ("back rest", (0.28, -0.2775, 0.46), (0.305, 0.2775, 0.86)),
        ("push handle right", (0.16, -0.2775, 0.85), (0.305, -0.2475, 0.89)),
        # A 0.33 x 0.02 plate rising forward at 45 deg: half extent (0.33 + 0.02) / 2 / sqrt 2.
        ("foot plate left", (1.04076, 0.02995, 0.03976), (1.28824, 0.27745, 0.28724)),
    ],
)
def test_furniture_is_where_the_mesh_is(environment, item, lower, upper):
    lowest, highest = environment.reach(f"wheelchair::{item}")
    # The figures have five digits.
    np.testing.assert_allclose(lowest, lower, atol=1e-5)
    np.testing.assert_allclose(highest, upper, atol=1e-5)


def test_the_chair_is_as_large_as_its_mesh(environment):
    chair = {part.name for part in environment.parts if part.name.startswith("wheelchair::")}
    assert len(chair) == 22
    lowest, highest = environment.reach(*chair)
    # Box of the whole mesh; our own parts follow it to within 3 mm.
    np.testing.assert_allclose(lowest, [0.0, -0.3325, 0.0], atol=0.003)
    np.testing.assert_allclose(highest, [1.2884, 0.3325, 0.89], atol=0.003)


def test_the_chair_rotates_and_shifts_about_its_own_origin(environment):
    X_WC = environment.pose(
        "wheelchair::base_link", wheelchair_x=0.1, wheelchair_y=-0.2, wheelchair_yaw=1
    )
    np.testing.assert_allclose(X_WC.translation(), [0.1, -0.2, 0.0], atol=1e-15)
    np.testing.assert_allclose(
        X_WC.rotation().matrix(), Rotation.from_euler("z", 1).as_matrix(), atol=1e-15
    )
    nominal = environment.pose("person::head_center")
    carried = environment.pose(
        "person::head_center", wheelchair_x=0.1, wheelchair_y=-0.2, wheelchair_yaw=1
    )
    np.testing.assert_allclose(
        carried.GetAsMatrix34(), (X_WC @ nominal).GetAsMatrix34(), atol=1e-15
    )


def test_the_person_shifts_along_their_own_axes_after_the_rotation(environment):
    seat = np.array([0.403, 0.0, 0.47])
    offset = environment.pose("person::head_center").translation() - seat
    for joints, shift in (
        # Axes of the original: positive x backward, positive y to the right.
        ({"person_x": 0.05}, [-0.05, 0, 0]),
        ({"person_y": 0.05}, [0, -0.05, 0]),
        ({"person_x": 0.03, "person_y": -0.02}, [-0.03, 0.02, 0]),
    ):
        for turn in (0.0, 0.4):
            # Positive yaw rotates to the person's right.
            R = Rotation.from_euler("z", -turn).as_matrix()
            got = environment.pose("person::head_center", person_yaw=turn, **joints).translation()
            np.testing.assert_allclose(got, seat + R @ (offset + shift), atol=1e-12)


def test_the_head_tilts_up_about_its_own_centre(environment):
    nominal = environment.pose("person::head_center")
    tilted = environment.pose("person::head_center", head_tilt=0.3)
    np.testing.assert_allclose(tilted.translation(), nominal.translation(), atol=1e-15)
    face = tilted.rotation().matrix()[:, 0]
    np.testing.assert_allclose(face, [np.cos(0.3), 0, np.sin(0.3)], atol=1e-12)
    np.testing.assert_array_equal(
        environment.pose("person::neck_link", head_tilt=0.3).GetAsMatrix34(),
        environment.pose("person::neck_link").GetAsMatrix34(),
    )


@pytest.fixture(scope="module")
def skin(environment):
    return environment.exposed_skin()


def test_most_of_the_skin_is_judged(skin):
    # Otherwise the two tests below would pass by leaving everything out.
    assert len(skin) > 3000
    assert len({link for link, _ in skin}) == 17


def test_padding_covers_the_inward_error_of_every_part(environment, skin):
    inward = dict.fromkeys(environment.file.body_frames.values(), -np.inf)
    for link, distances in skin:
        inward[link] = max(inward[link], min(distances.values()))
    padding = environment.file.padding
    assert {link: d for link, d in inward.items() if d > padding[link]} == {}
    # It is a fit, not an enclosure: skin does stand out, or these points judge nothing.
    assert max(inward.values()) > 0.01


def test_padded_shapes_enclose_the_exposed_skin(environment, skin):
    padding = environment.file.padding
    outside = [
        (link, worst)
        for link, distances in skin
        if (worst := min(d - padding[other] for other, d in distances.items())) > 0
    ]
    assert outside == []


def test_models_load_without_a_warning_from_drake(caplog):
    EnvironmentAlone("wheelchair")
    assert caplog.records == []


def test_pictures_show_what_is_checked(environment):
    for link, body in environment.added.links.items():
        checked = {
            (
                repr(environment.inspector.GetShape(g)),
                tuple(environment.inspector.GetPoseInFrame(g).GetAsMatrix34().ravel()),
            )
            for g in environment.plant.GetCollisionGeometriesForBody(body)
        }
        frame = environment.plant.GetBodyFrameIdOrThrow(body.index())
        shown = {
            (
                repr(environment.inspector.GetShape(g)),
                tuple(environment.inspector.GetPoseInFrame(g).GetAsMatrix34().ravel()),
            )
            for g in environment.inspector.GetGeometries(frame, Role.kIllustration)
        }
        assert shown == checked, link


@pytest.mark.parametrize("name", ["wheelchair", "bed"])
def test_the_head_turns_in_place_to_the_left(name, environment):
    scene = environment if name == "wheelchair" else EnvironmentAlone(name)
    links = set(scene.file.body_frames.values())
    before = {link: scene.pose(link) for link in links}
    after = {link: scene.pose(link, head_turn=0.5) for link in links}
    head = "person::head_center"
    for link in links - {head}:
        np.testing.assert_array_equal(after[link].GetAsMatrix34(), before[link].GetAsMatrix34())
    turn = before[head].inverse() @ after[head]
    # x of the head points out of the face, y to the left.
    expected = RotationMatrix.MakeZRotation(0.5).matrix()
    np.testing.assert_allclose(turn.rotation().matrix(), expected, atol=1e-12)
    np.testing.assert_allclose(turn.translation(), np.zeros(3), atol=1e-12)
