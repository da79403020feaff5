import math

import pytest

from tcs.model.grid import InitialConfiguration
from tcs.placement.reasons.explained import ahead_and_left, changes_between, sentence


def configuration(x=0.0, y=0.0, yaw_deg=0.0, torso=0.15, **environment):
    axes = tuple(
        (name.removesuffix("_deg"), math.radians(value) if name.endswith("_deg") else value)
        for name, value in environment.items()
    )
    units = tuple("rad" if name.endswith("_deg") else "m" for name in environment)
    return InitialConfiguration(
        base_x=x,
        base_y=y,
        base_yaw=math.radians(yaw_deg),
        torso=torso,
        environment=axes,
        environment_units=units,
    )


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ({}, {"x": 0.07}, "Drive 7 cm forward."),
        ({}, {"x": -0.07}, "Drive 7 cm back."),
        ({}, {"y": 0.1}, "Drive 10 cm to the left."),
        ({}, {"y": -0.1}, "Drive 10 cm to the right."),
        ({"yaw_deg": 90}, {"y": 1.25, "yaw_deg": 90}, "Drive 1.25 m forward."),
        ({"yaw_deg": 180}, {"y": 0.2, "yaw_deg": 180}, "Drive 20 cm to the right."),
        (
            {"yaw_deg": 45},
            {"x": 0.1, "yaw_deg": 45},
            "Drive 7.1 cm forward and 7.1 cm to the right.",
        ),
        ({}, {"yaw_deg": 45}, "Turn 45 deg to the left."),
        ({}, {"yaw_deg": 315}, "Turn 45 deg to the right."),
        ({"yaw_deg": 315}, {"yaw_deg": 45}, "Turn 90 deg to the left."),
        ({"yaw_deg": 90}, {"yaw_deg": 270}, "Turn 180 deg."),
        ({}, {"torso": 0.3}, "Raise the torso 15 cm."),
        ({}, {"torso": 0.0}, "Lower the torso 15 cm."),
        ({"bed_height": 0.2}, {"bed_height": 0.3}, "Raise the bed 10 cm."),
        ({"bed_height": 0.2}, {"bed_height": 0.0}, "Lower the bed 20 cm."),
        ({"head_rest_deg": 0}, {"head_rest_deg": 35}, "Raise the head rest 35 deg."),
        ({"head_rest_deg": 70}, {"head_rest_deg": 35}, "Lower the head rest 35 deg."),
        ({"table_slide": 0.5}, {"table_slide": 0.4}, "Change the table slide by -10 cm."),
        ({"chair_turn_deg": 0}, {"chair_turn_deg": 20}, "Change the chair turn by +20 deg."),
        ({}, {}, "Nothing needs to change."),
        # Below the rounding of the sentence.
        ({}, {"x": 0.0004, "yaw_deg": 0.04}, "Nothing needs to change."),
    ],
)
def test_words(before, after, words):
    assert sentence(configuration(**before), configuration(**after)) == words


def test_everything_in_one_sentence():
    before = configuration(x=1.0, yaw_deg=90, bed_height=0.1, head_rest_deg=35)
    after = configuration(x=0.9, y=-0.07, yaw_deg=45, torso=0.3, bed_height=0.2, head_rest_deg=0)
    assert sentence(before, after, around=1.5) == (
        "Drive 7 cm back and 10 cm to the left (1.50 m around the furniture), turn 45 deg to the "
        "right, raise the torso 15 cm, raise the bed 10 cm, lower the head rest 35 deg."
    )


@pytest.mark.parametrize("yaw_deg", [0, 30, 90, 135, 180, 225, 359, -720.5])
def test_driving_ahead_and_left_leads_there(yaw_deg):
    before = configuration(x=0.4, y=-1.3, yaw_deg=yaw_deg)
    after = configuration(x=-0.2, y=0.5)
    ahead, left = ahead_and_left(before, after)
    heading = math.radians(yaw_deg)
    # Ahead is the heading, left is a quarter turn further. A dozen roundings of numbers near 1.
    x = before.base_x + ahead * math.cos(heading) + left * math.cos(heading + math.pi / 2)
    y = before.base_y + ahead * math.sin(heading) + left * math.sin(heading + math.pi / 2)
    assert (x, y) == pytest.approx((after.base_x, after.base_y), abs=1e-14)


def test_changes_have_values_and_units():
    before = configuration(x=1.0, yaw_deg=350, bed_height=0.1, head_rest_deg=35)
    after = configuration(x=0.7, yaw_deg=10, bed_height=0.1, head_rest_deg=70)
    assert [change.to_json() for change in changes_between(before, after)] == [
        {
            "axis": "base_x",
            "from": 1.0,
            "to": 0.7,
            "change": -0.3,
            "unit": "m",
            "words": "drive 30 cm along -x",
        },
        {
            "axis": "base_yaw_deg",
            "from": 350.0,
            "to": 10.0,
            "change": 20.0,
            "unit": "deg",
            "words": "turn 20 deg to the left",
        },
        {
            "axis": "head_rest_deg",
            "from": 35.0,
            "to": 70.0,
            "change": 35.0,
            "unit": "deg",
            "words": "raise the head rest 35 deg",
        },
    ]
