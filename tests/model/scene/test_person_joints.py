"""Joints of the person: angles as stated, else the posture of the file; who may have them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.model.people import draw_bodies, named_postures, scales_of_people
from tcs.model.scene import PeopleInScene, environment_at, load_environment, with_person
from tcs.model.scene.person.joints import person_joints
from tcs.model.scene.person.resized import PARENTS
from tcs.placement.scoring import load_job
from tests.model.scene.environments import EnvironmentAlone

ENVIRONMENTS = ("wheelchair", "bed")
STATES = {
    "wheelchair": {"person_yaw": 0.2, "person_x": 0.01, "head_turn": 0.4, "head_tilt": 0.2},
    "bed": {"head_rest": 0.7, "head_turn": 0.4, "head_tilt": 0.2},
}
_built: dict[tuple[str, str], EnvironmentAlone] = {}


def posed(name, **angles):
    """Return an environment whose person has these angles [deg], in Drake."""
    key = name, repr(angles)
    if key not in _built:
        file = load_environment(name)
        person = {f"{joint}_deg": angle for joint, angle in angles.items()}
        _built[key] = EnvironmentAlone(with_person(file, person) if person else file)
    return _built[key]


def origin(scene, link):
    return scene.pose(f"person::{link}_link").translation()


def bend(scene, *links):
    """Return the angle at the middle one of three links, 0 where they are in line [deg]."""
    a, b, c = (origin(scene, link) for link in links)
    first, second = b - a, c - b
    cosine = first @ second / np.linalg.norm(first) / np.linalg.norm(second)
    return math.degrees(math.acos(np.clip(cosine, -1.0, 1.0)))


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_joints_at_the_angles_of_the_file_change_no_frame(name):
    before = posed(name)
    # Its own joints only: the model is the file, to the last bit.
    assert not person_joints(before.file).is_articulated
    assert "shoulder_flexion_left" not in before.added.joints.by_name
    after = posed(name, head_lean=0)
    for state in ({}, STATES[name]):
        for link in before.file.body_frames.values():
            # The files round orientations to seven digits.
            np.testing.assert_allclose(
                before.pose(link, **state).GetAsMatrix34(),
                after.pose(link, **state).GetAsMatrix34(),
                atol=1e-6,
            )


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_have_the_angles_that_are_stated(name, side):
    stated = {
        f"shoulder_flexion_{side}": 60,
        f"elbow_flexion_{side}": 90,
        f"knee_flexion_{side}": 40,
        f"hip_flexion_{side}": 50,
    }
    scene = posed(name, **stated)
    links = (f"{link}_{side}" for link in ("arm", "forearm", "hand"))
    assert bend(scene, *links) == pytest.approx(90, abs=0.1)
    assert bend(scene, f"quad_{side}", f"calf_{side}", f"foot_{side}") == pytest.approx(40, abs=0.1)
    trunk = scene.pose("person::upper_body_link").rotation().matrix()[:, 0]
    for upper, lower, angle in (("arm", "forearm", 60), ("quad", "calf", 50)):
        limb = origin(scene, f"{lower}_{side}") - origin(scene, f"{upper}_{side}")
        # In the plane in which they flex; elbows are beside the shoulders.
        limb = limb - limb[1] * np.array([0.0, 1.0, 0.0])
        found = math.degrees(math.acos(limb @ trunk / np.linalg.norm(limb)))
        assert found == pytest.approx(angle, abs=0.1)
    # Beyond the joint, the other side stays.
    other = "right" if side == "left" else "left"
    for link in (f"hand_{other}", f"foot_{other}"):
        np.testing.assert_allclose(origin(scene, link), origin(posed(name), link), atol=1e-6)


UP = {"wheelchair": np.array([0, 0, 1.0]), "bed": np.array([-1.0, 0, 0])}
FRONT = {"wheelchair": np.array([1.0, 0, 0]), "bed": np.array([0, 0, 1.0])}
LEFT = np.array([0, 1.0, 0])


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize(
    ("joint", "link", "toward"),
    [
        ("shoulder_flexion_left", "forearm_left", "front"),
        ("shoulder_abduction_left", "forearm_left", "left"),
        ("shoulder_abduction_right", "forearm_right", "right"),
        ("shoulder_rotation_left", "hand_left", "left"),
        ("shoulder_rotation_right", "hand_right", "right"),
        ("elbow_flexion_right", "hand_right", "up and front"),
        ("hip_flexion_left", "calf_left", "up and front"),
        ("hip_abduction_left", "calf_left", "left"),
        ("hip_abduction_right", "foot_right", "right"),
        ("knee_flexion_left", "foot_left", "back"),
    ],
)
def test_positive_angles_are_those_that_the_names_say(name, joint, link, toward):
    directions = {
        "front": FRONT[name], "back": -FRONT[name], "up and front": UP[name] + FRONT[name],
        "left": LEFT, "right": -LEFT,
    }  # fmt: skip
    at = math.degrees(person_joints(posed(name, head_lean=0).file).in_file[joint])
    # With the forearm bent, a rotation of the upper arm moves the hand.
    side = joint.rpartition("_")[2]
    more = {f"elbow_flexion_{side}": 60} if joint.startswith("shoulder_rotation") else {}
    # At the angles of the file no frame is elsewhere, see above.
    before, after = posed(name, **more), posed(name, **more, **{joint: at + 20})
    moved = origin(after, link) - origin(before, link)
    assert moved @ directions[toward] > 0.02


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_head_and_trunk_lean(name):
    before, after = posed(name), posed(name, head_lean=20)
    moved = [scene.pose("person::head_center").translation() for scene in (before, after)]
    assert (moved[1] - moved[0])[1] > 0.04
    np.testing.assert_allclose(origin(before, "upper_body"), origin(after, "upper_body"), atol=1e-6)
    if name == "bed":
        return
    sideways, forward = posed(name, trunk_lean=20), posed(name, trunk_flexion=20)
    head = before.pose("person::head_center").translation()
    assert (sideways.pose("person::head_center").translation() - head)[1] > 0.15
    assert (forward.pose("person::head_center").translation() - head)[0] > 0.15
    for scene in (sideways, forward):
        np.testing.assert_allclose(
            origin(scene, "foot_left"), origin(before, "foot_left"), atol=1e-6
        )


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.parametrize("posture", named_postures())
def test_named_postures_reach_into_nothing(name, posture):
    if named_postures()[posture].lying and name == "wheelchair":
        with pytest.raises(TcsError, match="a person who lies"):
            person_joints(with_person(load_environment(name), {"posture": posture}))
        return
    scene = EnvironmentAlone(with_person(load_environment(name), {"posture": posture}))
    before, after = (_overlaps(one) for one in (posed(name, head_lean=0), scene))
    for pair, depth in after.items():
        assert depth < before.get(pair, 0.0) + 0.02, pair


def _overlaps(scene):
    """Return how far the person's parts reach into furniture and parts they are not joined to."""
    scene.set()
    names = {part.geometry: part.name for part in scene.parts}
    joined = {frozenset((f"person::{a}", f"person::{b}")) for a, b in PARENTS.items()}
    joined.add(frozenset(("person::mid_body_link", "person::quad_left_link")))
    joined.add(frozenset(("person::mid_body_link", "person::quad_right_link")))
    found = {}
    for pair in scene.query().ComputeSignedDistancePairwiseClosestPoints(0.0):
        both = frozenset((names[pair.id_A], names[pair.id_B]))
        if both not in joined:
            found[both] = max(found.get(both, 0.0), -pair.distance)
    return found


@pytest.mark.parametrize(
    ("name", "person", "message"),
    [
        ("wheelchair", {"shoulder_flexion_left_deg": 170}, "moves it from -62 to 167 deg"),
        ("wheelchair", {"age": 70, "elbow_flexion_left_deg": 2}, "moves it from 4 to 143 deg"),
        ("bed", {"trunk_lean_deg": 5}, "joint of a seated person"),
        ("bed", {"posture": "knees_bend"}, "Did you mean 'knees_bent'"),
    ],
)
def test_postures_that_the_person_cannot_have_are_refused(name, person, message):
    with pytest.raises(TcsError, match=message) as raised:
        EnvironmentAlone(with_person(load_environment(name), person))
    assert "\n" not in str(raised.value)


def test_an_axis_is_limited_to_what_the_person_can_do(tmp_path):
    path = tmp_path / "lifted.yaml"
    axis = "{unit: deg, start: 0, step: 30, count: %d}"
    axes = {"base_x": 1, "base_y": 1, "base_yaw": 1, "torso": 1, "shoulder_abduction_left": 4}
    grid = "".join(f"  {name}: {axis % count}\n" for name, count in axes.items())
    grid = grid.replace("x: {unit: deg", "x: {unit: m").replace("y: {unit: deg", "y: {unit: m")
    grid = grid.replace("torso: {unit: deg", "torso: {unit: m")
    path.write_text(
        f"name: lifted\nbased_on: bed\ngrid:\n{grid}person: {{shoulder_left_mobility: 0.4}}\n"
    )
    with pytest.raises(TcsError, match=r"'shoulder_abduction_left' is 90 deg; .* 0 to 73\.6 deg"):
        load_environment(path)
    path.write_text(path.read_text().replace("0.4", "0.5"))
    scene = EnvironmentAlone(load_environment(path))
    hand = [scene.pose("person::hand_left_link", shoulder_abduction_left=a) for a in (0.0, 1.5)]
    assert hand[1].translation()[1] - hand[0].translation()[1] > 0.3
    # What is not named follows the head rest as before.
    assert "shoulder_flexion_left" in scene.added.joints.posture["head_rest"].joints


@pytest.mark.parametrize(
    ("name", "task", "angles"),
    [
        ("bed", "bathing", {"head_lean_deg": 20, "shoulder_abduction_left_deg": 60}),
        (
            "wheelchair",
            "shaving",
            {"trunk_flexion_deg": 20, "trunk_lean_deg": 10, "head_lean_deg": -20},
        ),
    ],
)
def test_people_in_a_posture_equal_the_resized_scene(name, task, angles):
    states = ({}, STATES[name])
    states = [{**dict.fromkeys(STATES[name], 0.0), **state} for state in states]
    job = load_job(task, name, "pr2", person=angles)
    scene = job.scene()
    drawn = draw_bodies(1, seed=4)
    people = PeopleInScene(job.lowered(scene), scene, job.task, states)
    (found,) = people.arrays_of(scales_of_people(drawn), np.array([[0, 1]]))
    alone = load_job(task, name, "pr2", person={"sex": drawn[0].sex, **drawn[0].measures, **angles})
    resized = alone.scene()
    expected = environment_at(alone.lowered(resized), resized, alone.task, states)
    np.testing.assert_allclose(found.environment.p, expected.environment.p, atol=2e-6)
    np.testing.assert_allclose(found.environment.R, expected.environment.R, atol=2e-6)
    np.testing.assert_allclose(found.goal_p, expected.goal_p, atol=2e-6)
