"""Sizes of wheelchair and bed: boxes where the parameters say, the person on the seat."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import EnvironmentFileError
from tcs.model.scene import load_environment
from tests.model.scene.environments import EnvironmentAlone

TRUNK = ("head_center", "upper_body_link", "lower_body_link", "quad_left_link")


@pytest.fixture
def sized(tmp_path):
    """Function that returns an environment with sizes, in Drake."""

    def build(base, text):
        path = tmp_path / "sized.yaml"
        path.write_text(f"name: sized\nbased_on: {base}\n{text}\n")
        return EnvironmentAlone(load_environment(path))

    return build


def box_named(scene, name):
    """Return the part that a box of the furniture is."""
    (part,) = (part for part in scene.parts if part.name.partition("::")[2] == name)
    return part


def corners(scene, name):
    """Return the corners of a box in W, shape (8, 3)."""
    part = box_named(scene, name)
    box, X = scene.inspector.GetShape(part.geometry), scene.query().GetPoseInWorld(part.geometry)
    half = np.array([box.width(), box.depth(), box.height()]) / 2
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    return (signs * half) @ X.rotation().matrix().T + X.translation()


@pytest.mark.parametrize("base", ["wheelchair", "bed"])
def test_standard_furniture_is_that_of_the_papers(sized, base):
    before, after = EnvironmentAlone(base), sized(base, f"{base}: standard")
    for one, other in zip(before.parts, after.parts, strict=True):
        X = [scene.query().GetPoseInWorld(part.geometry).GetAsMatrix34()
             for scene, part in ((before, one), (after, other))]  # fmt: skip
        np.testing.assert_allclose(*X, atol=1e-12)
        assert one.name == other.name
    # Without the key nothing is rewritten.
    assert before.file.wheelchair is None
    assert before.file.bed is None


def test_the_seat_has_the_sizes_that_are_stated(sized):
    text = "wheelchair: {seat_width: 0.55, seat_depth: 0.5, seat_height: 0.52}"
    before, after = EnvironmentAlone("wheelchair"), sized("wheelchair", text)
    inner = [corners(after, f"side panel {side}")[:, 1] for side in ("left", "right")]
    assert inner[0].min() - inner[1].max() == pytest.approx(0.55)
    seat, back = corners(after, "seat"), corners(after, "back rest")
    assert seat[:, 0].max() - back[:, 0].max() == pytest.approx(0.5)
    assert seat[:, 2].max() == pytest.approx(0.52)
    # Wheels keep their size and stay on the floor.
    for name in ("rear wheel left", "front wheel right"):
        sizes = [np.ptp(corners(scene, name), axis=0) for scene in (before, after)]
        np.testing.assert_allclose(*sizes, atol=1e-12)
        assert corners(after, name)[:, 2].min() == pytest.approx(0.0, abs=1e-12)
    post = corners(after, "front post left")[:, 2]
    assert (post.min(), post.max()) == pytest.approx((0.256, 0.52))
    # The person is on the seat, the feet with the plates.
    for link in (*TRUNK, "foot_left_link"):
        moved = [scene.pose(f"person::{link}").translation() for scene in (before, after)]
        np.testing.assert_allclose(moved[1] - moved[0], [0, 0, 0.05], atol=1e-12)


def test_back_rest_and_trunk_lean_together(sized):
    before, after = (
        EnvironmentAlone("wheelchair"),
        sized("wheelchair", "wheelchair: {back_angle_deg: 20}"),
    )
    back = after.query().GetPoseInWorld(box_named(after, "back rest").geometry)
    trunk = after.pose("person::upper_body_link").rotation().matrix()[:, 0]
    # Both lean by 20 degrees; the trunk is upright in the papers.
    up = np.array([-np.sin(np.radians(20)), 0, np.cos(np.radians(20))])
    np.testing.assert_allclose(back.rotation().matrix()[:, 2], up, atol=1e-12)
    np.testing.assert_allclose(-trunk, up, atol=1e-6)
    np.testing.assert_allclose(
        *(scene.pose("person::quad_left_link").translation() for scene in (before, after)),
        atol=1e-6,
    )


def test_a_tilted_seat_takes_the_person_along(sized):
    before = EnvironmentAlone("wheelchair")
    after = sized("wheelchair", "wheelchair: {tilt_deg: 30}")
    for link in TRUNK:
        distances = []
        for scene in (before, after):
            point = scene.pose(f"person::{link}").translation()
            distances.append(np.linalg.norm(point - corners(scene, "seat"), axis=1))
        np.testing.assert_allclose(*distances, atol=1e-9)
    assert after.pose("person::head_center").translation()[0] < 0.1


def test_a_bed_has_the_length_and_width_that_are_stated(sized):
    before, after = EnvironmentAlone("bed"), sized("bed", "bed: {length: 2.3, width: 1.1}")
    boards = [corners(after, name)[:, 0].mean() for name in ("headboard", "footboard")]
    assert boards[1] - boards[0] == pytest.approx(2.3 - 0.01)
    for name in ("mattress head section", "mattress calf section", "pillow"):
        assert np.ptp(corners(after, name)[:, 1]) == pytest.approx(1.1)
    calves = corners(after, "mattress calf section")[:, 0]
    assert calves.max() == pytest.approx(
        corners(before, "mattress calf section")[:, 0].max() + 0.16
    )
    assert calves.min() == pytest.approx(corners(before, "mattress calf section")[:, 0].min())
    # Sections stay joined, and the person where they were.
    thighs = corners(after, "mattress thigh section")[:, 0]
    assert thighs.max() == pytest.approx(calves.min())
    np.testing.assert_allclose(
        *(scene.pose("person::foot_left_link").translation() for scene in (before, after))
    )


@pytest.mark.parametrize("preset", ["wide", "child", "tilt-in-space"])
def test_presets_fill_in_what_is_not_stated(sized, preset):
    chair = sized("wheelchair", f"wheelchair: {preset}").file.wheelchair
    assert chair.preset == preset
    own = sized("wheelchair", f"wheelchair: {{preset: {preset}, seat_width: 0.5}}").file.wheelchair
    assert own.seat_width == 0.5
    assert (own.seat_depth, own.tilt_deg) == (chair.seat_depth, chair.tilt_deg)


@pytest.mark.parametrize(
    ("base", "text", "message"),
    [
        ("wheelchair", "wheelchair: {seat_width: 2}", "seat_width"),
        ("wheelchair", "wheelchair: {seat: 0.5}", "seat"),
        ("wheelchair", "wheelchair: sporty", "preset"),
        ("wheelchair", "bed: wide", "no model is named 'bed'"),
        (
            "wheelchair",
            "wheelchair: {back_angle_deg: 10}\nperson: {trunk_mobility: 0.1}",
            "-10 deg",
        ),
    ],
)
def test_sizes_that_cannot_be_are_refused_in_one_line(sized, base, text, message):
    with pytest.raises(Exception, match=message) as raised:
        sized(base, text)
    assert "\n" not in str(raised.value)


def test_another_wheelchair_has_no_sizes(sized, tmp_path):
    (tmp_path / "box.sdf").write_text(
        '<sdf version="1.9"><model name="b"><link name="base_link"/></model></sdf>'
    )
    text = "models: [{name: wheelchair, file: box.sdf}]\nbody_frames: {}\npadding: {}\nerrors: {}"
    text += "\nwheelchair: wide"
    with pytest.raises(EnvironmentFileError, match="has no box 'seat'"):
        sized("wheelchair", text)
