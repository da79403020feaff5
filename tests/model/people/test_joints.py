"""Ranges of motion by age and sex, mobility, and postures by name and by angle."""

import pytest

from tcs.errors import DataFileError, UnknownNameError
from tcs.model.people import JOINTS, Person, load_person, named_postures, range_of_motion


@pytest.mark.parametrize("sex", ["female", "male", None])
@pytest.mark.parametrize("age", [4, 8.5, 9, 44.9, 64.5, 65, 120, None])
def test_every_joint_has_a_range_at_every_age(sex, age):
    for joint in JOINTS:
        lower, upper = range_of_motion(joint, sex, age)
        assert lower <= 5 < 40 <= upper or joint.startswith("trunk_lean")
    with pytest.raises(UnknownNameError, match="Did you mean"):
        range_of_motion("elbow_flexion")


def test_ranges_are_those_printed():
    assert range_of_motion("shoulder_flexion_left", "male", 30) == (-62.0, 167.0)
    assert range_of_motion("shoulder_flexion_right", "female", 70) == (-44.0, 165.0)
    assert range_of_motion("knee_flexion_left", "female", 6) == (-5.4, 152.6)
    assert range_of_motion("head_turn") == (-80.0, 80.0)


def test_mobility_is_that_of_the_closest_name():
    person = Person(shoulder_mobility=0.5, shoulder_left_mobility=0.2, neck_mobility=0.25)
    assert person.range_of("shoulder_abduction_right") == (0.0, 92.0)
    assert person.range_of("shoulder_abduction_left") == pytest.approx((0.0, 36.8))
    assert person.range_of("head_turn") == (-20.0, 20.0)
    stiff = Person(elbow_left_mobility=0, elbow_flexion_left_least_deg=95,
                   elbow_flexion_left_greatest_deg=110, elbow_flexion_left_deg=100)  # fmt: skip
    stiff.check_posture()
    assert stiff.range_of("elbow_flexion_left") == (95.0, 110.0)


def test_healthy_people_of_any_age_can_have_every_named_posture():
    for name in named_postures():
        for sex in ("female", "male"):
            for age in (20, 70):
                Person(sex=sex, age=age, posture=name).check_posture()


def test_a_posture_is_read_from_a_file(tmp_path):
    path = tmp_path / "anna.yaml"
    path.write_text("age: 70\nposture: {name: arm_lifted_left, head_turn_deg: 20}\n")
    person = load_person(path)
    assert not person.has_body
    assert person.angles["shoulder_abduction_left"] == 70.0
    assert person.angles["head_turn"] == 20.0
    # What is recorded gives the same person.
    assert load_person(person.to_json()["given"]) == person
    both = load_person({**person.to_json()["given"], "sex": "female", "stature": 1.6})
    assert both.without_body() == person


@pytest.mark.parametrize(
    ("person", "message"),
    [
        ({"posture": "arm"}, "unknown posture 'arm'"),
        ({"posture": {"elbow": 3}}, "must be 'name' or an angle"),
        ({"posture": {"head_turn_deg": 3}, "head_turn_deg": 4}, "given twice"),
        ({"head_trun_deg": 3}, "Did you mean 'head_turn'"),
        ({"head_turn_deg": 81}, "moves it from -80 to 80 deg"),
        ({"neck_mobility": 0.5, "head_turn_deg": 41}, "moves it from -40 to 40 deg"),
        ({"neck_mobility": 2, "posture": "arms_apart"}, "must be 0 to 1"),
        ({"nek_mobility": 0.5, "posture": "arms_apart"}, "Did you mean 'neck'"),
        ({"age": 3, "posture": "arms_apart"}, "age"),
        ({"elbow_least_deg": 3, "posture": "arms_apart"}, "unknown joint of the person 'elbow'"),
    ],
)
def test_odd_postures_are_refused_in_one_line(person, message):
    with pytest.raises((DataFileError, UnknownNameError), match=message) as raised:
        load_person(person)
    assert "\n" not in str(raised.value)
