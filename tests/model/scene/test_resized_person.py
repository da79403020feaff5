"""A resized person: sizes as asked, links connected, on the seat or mattress, goals on the skin."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.errors import EnvironmentFileError
from tcs.model.people import PAPERS_MAN, Person, papers_man
from tcs.model.scene import goals_on_person, load_environment, with_person
from tcs.model.scene.person.covers import cover, padding_for
from tcs.model.scene.person.resized import (
    PARENTS,
    covers_of,
    padding_of,
    part_of,
    person_shapes,
    scales_of,
)
from tcs.model.scene.person.shapes import LinkShape
from tcs.model.tasks import load_task, task_names
from tests.model.scene.environments import EnvironmentAlone

PEOPLE = {
    "woman-5": Person(sex="female", stature_percentile=5, mass_percentile=5),
    "man-95": Person(sex="male", stature_percentile=95, mass_percentile=95),
    "stout-woman": Person(sex="female", stature_percentile=20, mass_percentile=97),
}
SAME = Person(sex="male", **PAPERS_MAN)
ENVIRONMENTS = ("wheelchair", "bed")


@pytest.fixture(scope="module")
def alone():
    """Function that returns an environment in Drake without a robot, for a person or None."""
    built = {}

    def get(name, who=None):
        if (name, who) not in built:
            file = load_environment(name)
            person = {**PEOPLE, "same": SAME}.get(who)
            built[name, who] = EnvironmentAlone(with_person(file, person) if person else file)
        return built[name, who]

    return get


def extent(scene, *links):
    """Return least and greatest corner of the shapes of some links in W."""
    corners = [_corners(scene)[f"person::{link}"] for link in links]
    return np.min([c[0] for c in corners], axis=0), np.max([c[1] for c in corners], axis=0)


@cache
def _corners(scene):
    """Return the bounding box in W of every link of the person."""
    scales = scales_of(scene.file)
    found = {}
    for link, shapes in person_shapes(scene.file).items():
        X = scene.pose(link)
        R, p = X.rotation().matrix(), X.translation()
        covers = covers_of(scene.file, link, shapes, scales.get(link, (1.0, 1.0, 1.0)))
        boxes = [shape.extent(R, p) for cover in covers for shape in cover]
        found[link] = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    return found


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_body_of_the_same_size_keeps_every_frame(alone, name):
    before, after = alone(name), alone(name, "same")
    for link in before.file.body_frames.values():
        np.testing.assert_allclose(
            before.pose(link).GetAsMatrix34(), after.pose(link).GetAsMatrix34(), atol=1e-9
        )


@pytest.mark.parametrize("who", PEOPLE)
def test_sizes_measured_on_the_shapes_are_those_asked(alone, who):
    scene = alone("wheelchair", who)
    asked = PEOPLE[who].body().measures
    low, high = extent(scene, "head_center", "quad_left_link", "quad_right_link")
    # The trunk is stretched along a spine that is bent, and in depth, so a few per cent.
    assert high[2] - low[2] == pytest.approx(asked["sittingheight"], rel=0.03)
    low, high = extent(scene, "quad_left_link", "quad_right_link")
    # Capsules are round: their radius is the mean of what height and breadth ask for.
    assert high[1] - low[1] == pytest.approx(asked["hipbreadthsitting"], rel=0.07)
    assert high[2] - low[2] == pytest.approx(asked["thighclearance"], rel=0.13)
    for side in ("left", "right"):
        shoulder, elbow, wrist = (
            scene.pose(f"person::{link}_{side}_link").translation()
            for link in ("arm", "forearm", "hand")
        )
        before = alone("wheelchair").pose(f"person::arm_{side}_link").translation()
        bent = alone("wheelchair").pose(f"person::forearm_{side}_link").translation()
        ratio = np.linalg.norm(elbow - shoulder) / np.linalg.norm(bent - before)
        # The elbow is a few centimetres beside the axis of the upper arm.
        expected = asked["shoulderelbowlength"] / papers_man().measures["shoulderelbowlength"]
        assert ratio == pytest.approx(expected, rel=0.02)
        forearm = asked["forearmhandlength"] - asked["handlength"]
        assert np.linalg.norm(wrist - elbow) == pytest.approx(0.251 * forearm / 0.3, rel=0.01)


@pytest.mark.parametrize(("name", "who"), [("wheelchair", "stout-woman"), ("bed", "man-95")])
def test_links_stay_connected_and_symmetric(alone, name, who):
    before, after = alone(name), alone(name, who)
    for link, parent in PARENTS.items():
        gap = [_gap(scene, link, parent) for scene in (before, after)]
        # Overlapping shapes are 0 apart; a link is at most 2.5 times as large.
        assert gap[1] <= 2.5 * gap[0] + 0.01
    for link in (link for link in PARENTS if "left" in link):
        left, right = (
            after.pose(f"person::{other}").translation()
            for other in (link, link.replace("left", "right"))
        )
        # The original's right arm is bent by a degree or two less than the left one.
        np.testing.assert_allclose(left * (1, -1, 1), right, atol=0.012)
        assert part_of(link) == part_of(link.replace("left", "right"))


def _gap(scene, link, parent):
    """Return the distance between the bounding boxes of two links, 0 where they overlap [m]."""
    (low, high), (below, above) = extent(scene, link), extent(scene, parent)
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(low - above, below - high))))


@pytest.mark.parametrize("who", ["man-95"])
def test_the_person_is_on_the_seat_or_on_the_mattress(alone, who):
    trunk = ("upper_body_link", "mid_body_link", "lower_body_link")
    thighs = ("quad_left_link", "quad_right_link")
    before, after = alone("wheelchair"), alone("wheelchair", who)
    assert extent(after, *thighs)[0][2] == pytest.approx(extent(before, *thighs)[0][2], abs=1e-6)
    assert extent(after, *trunk)[0][0] == pytest.approx(extent(before, *trunk)[0][0], abs=1e-6)
    before, after = alone("bed"), alone("bed", who)
    assert extent(after, *trunk)[0][2] == pytest.approx(extent(before, *trunk)[0][2], abs=1e-6)
    hips = [scene.pose("person::lower_body_link").translation()[0] for scene in (before, after)]
    assert hips[0] == pytest.approx(hips[1], abs=1e-6)


SIZES = [(5, 5), (5, 95), (95, 5), (95, 95), (20, 97)]
"""Percentiles of height and weight."""
EXTREMES = [(5, 95), (95, 5)]
"""Those whose proportions are farthest from the mean."""


@pytest.mark.parametrize("name", ["wheelchair", "bed"])
@pytest.mark.parametrize(
    "percentiles",
    [pytest.param(at, marks=[] if at in EXTREMES else pytest.mark.slow) for at in SIZES],
    ids=str,
)
def test_padded_shapes_enclose_the_skin_stretched_like_their_link(name, percentiles, rng):
    file = load_environment(name)
    stature, mass = percentiles
    person = Person(sex="female", stature_percentile=stature, mass_percentile=mass)
    scales, shapes = scales_of(with_person(file, person)), person_shapes(file)
    directions = rng.normal(size=(300, 3))
    for link, scale in scales.items():
        assert (allowed := padding_of(file, link, scales)) <= file.padding[link]
        covers = covers_of(file, link, shapes[link], scale)
        for shape, covering in zip(shapes[link], covers, strict=True):
            # Skin as far from the surface of the papers' man as his padding lets it be.
            for direction in directions:
                _, surface, normal = shape.nearest(shape.p_LoSo_L + 2.0 * direction)
                skin = shape.p_LoSo_L + shape.R_LS @ (surface + file.padding[link] * normal)
                beyond = min(one.nearest(np.array(scale) * skin)[0] for one in covering)
                # Rounding, and that of orientations in the model files.
                assert beyond <= allowed + 1e-7


@pytest.mark.parametrize(
    ("is_box", "parts"), [(True, 1), (False, 1), (False, 2)], ids=["box", "capsule", "two-capsules"]
)
def test_any_stretched_shape_is_enclosed(is_box, parts, rng):
    for _ in range(30):
        scale = tuple(rng.uniform(0.6, 2.0, 3))
        R = Rotation.random(rng=rng).as_matrix()
        size = rng.uniform(0.02, 0.15, 3 if is_box else 2)
        shape = LinkShape(is_box, size, R, rng.uniform(-0.1, 0.1, 3))
        covering, allowed = cover(shape, scale, 0.015, parts), padding_for(0.015, scale)
        assert len(covering) == parts
        for direction in rng.normal(size=(100, 3)):
            _, surface, normal = shape.nearest(shape.p_LoSo_L + direction)
            skin = shape.p_LoSo_L + R @ (surface + 0.015 * normal)
            assert min(one.nearest(np.array(scale) * skin)[0] for one in covering) <= allowed + 1e-9


def test_two_capsules_are_closer_to_an_elliptic_body_than_one():
    shape = LinkShape(False, np.array([0.1, 0.04]), np.eye(3), np.zeros(3))
    scale = (1.5, 1.1, 1.2)
    thick = [max(one.reach(np.eye(3)[1]) for one in cover(shape, scale, 0.0, n)) for n in (1, 2)]
    # The body reaches 0.11 m there; round capsules as broad as it is reach 0.15 m.
    assert thick[0] == pytest.approx(0.15)
    assert 0.11 < thick[1] < 0.12


@pytest.mark.parametrize("name", task_names())
def test_goals_keep_their_distance_from_the_padded_skin(name):
    task = load_task(name)
    file = load_environment(task.environments[0])
    shapes_of = person_shapes(file)
    for person in (SAME, PEOPLE["stout-woman"]):
        environment = with_person(file, person)
        moved = goals_on_person(task, environment)
        scales = scales_of(environment)
        for before, after in zip(task.goals, moved.goals, strict=True):
            link = file.body_frames[before.body_frame]
            scale = scales[link]
            grown = padding_of(environment, link, scales) - file.padding[link]
            shapes = shapes_of[link]
            d = [shape.nearest(before.position)[0] for shape in shapes]
            covering = covers_of(environment, link, shapes, scale)[int(np.argmin(d))]
            found = min(one.nearest(after.position)[0] for one in covering)
            # Never nearer; farther where the shape curves away beside its outermost point.
            assert min(d) + grown - 1e-12 <= found <= min(d) + grown + 0.02
            np.testing.assert_allclose(before.quaternion, after.quaternion, atol=1e-15)
            if person is SAME:
                np.testing.assert_allclose(before.position, after.position, atol=1e-9)
    assert goals_on_person(task, file) is task


def nearest_of_all(shapes, point):
    """Return the signed distance from the nearest of some shapes, and its normal, in the link."""
    found = [(*shape.nearest(point)[::2], shape.R_LS) for shape in shapes]
    distance, normal, R_LS = min(found, key=lambda one: one[0])
    return distance, R_LS @ normal


@pytest.mark.parametrize("who", ["6", "10", "stout-woman"])
def test_goals_are_not_turned_against_the_skin(who):
    """The angle of x of the tool with the normal of the nearest shape is that on the papers' man.

    Within 5 degrees: a thigh of other proportions is two capsules side by side.
    """
    person = PEOPLE.get(who) or Person(sex="female", age=float(who))
    for name in ("shaving", "bathing"):
        task = load_task(name)
        file = load_environment(task.environments[0])
        environment, shapes_of = with_person(file, person), person_shapes(file)
        scales = scales_of(environment)
        for before, after in zip(task.goals, goals_on_person(task, environment).goals, strict=True):
            link = file.body_frames[before.body_frame]
            covers = covers_of(environment, link, shapes_of[link], scales[link])
            resized = [one for covering in covers for one in covering]
            grown = padding_of(environment, link, scales) - file.padding[link]
            x = Rotation.from_quat(after.quaternion, scalar_first=True).as_matrix()[:, 0]
            least, of_man = nearest_of_all(shapes_of[link], before.position)
            distance, normal = nearest_of_all(resized, after.position)
            turned = np.arccos(x @ normal) - np.arccos(x @ of_man)
            assert abs(np.degrees(turned)) < 5.0, before.name
            assert distance >= least + grown - 1e-12


@pytest.mark.parametrize("is_box", [True, False], ids=["box", "capsule"])
def test_points_lead_back_from_their_nearest_point_of_the_surface(is_box):
    generator = np.random.default_rng(0)
    size = np.array([0.1, 0.2, 0.3]) if is_box else np.array([0.1, 0.2])
    shape = LinkShape(is_box, size, np.eye(3), np.array([0.1, 0.0, -0.1]))
    for point in generator.uniform(-0.6, 0.6, (50, 3)):
        distance, surface, normal = shape.nearest(point)
        back = shape.p_LoSo_L + surface + distance * normal
        np.testing.assert_allclose(back, point, atol=1e-12)
        assert shape.nearest(shape.p_LoSo_L + surface)[0] == pytest.approx(0.0, abs=1e-12)
        # Nothing of a convex shape is beyond the plane through the point, across the normal.
        beyond = shape.reach(normal) - float(normal @ (shape.p_LoSo_L + surface))
        assert beyond == pytest.approx(0.0, abs=1e-12)


def test_the_person_of_an_environment_file_is_resized(tmp_path):
    path = tmp_path / "hers.yaml"
    text = "name: hers\nbased_on: wheelchair\nperson: {sex: female, stature_percentile: 5}\n"
    path.write_text(text)
    assert load_environment(path).person == Person(sex="female", stature_percentile=5)
    path.write_text(text.replace("female", "female, statur: 1.5"))
    with pytest.raises(Exception, match=r"hers\.yaml', field 'person': unknown body measure"):
        load_environment(path)
    path.write_text("name: hers\nbased_on: wheelchair\nperson: wheelchair\n")
    assert load_environment(path).is_person("wheelchair")


def test_another_model_cannot_be_resized():
    with pytest.raises(EnvironmentFileError, match="no link 'head_center'"):
        EnvironmentAlone(with_person(load_environment("wheelchair"), {
            "model": "wheelchair", "sex": "male",
        }))  # fmt: skip
    with pytest.raises(EnvironmentFileError, match="no model 'guest'"):
        with_person(load_environment("wheelchair"), {"model": "guest", "sex": "male"})
    assert not list(Path.cwd().glob("*.sdf"))
