"""The place of the robot relative to the person, against the axes of a body by hand."""

from __future__ import annotations

import math

import pytest

from tcs.output.words import relative_place, stop_places

SITTING = {
    "head": (0.45, 0.0, 1.2), "chest": (0.4, 0.0, 1.1), "lower_body": (0.44, 0.0, 0.6),
    "upper_arm_left": (0.4, 0.18, 1.0), "upper_arm_right": (0.4, -0.18, 1.0),
    "calf_left": (0.9, 0.1, 0.6), "calf_right": (0.9, -0.1, 0.6),
    "foot_left": (1.1, 0.1, 0.2), "foot_right": (1.1, -0.1, 0.2),
}  # fmt: skip
LYING = {name: (x, y, 0.6) for name, (x, y, _) in SITTING.items()}


@pytest.mark.parametrize(
    ("frames", "x", "y", "yaw_deg", "text"),
    [
        (SITTING, 0.9, -0.8, 90, "On the person's right, beside the knees, facing them."),
        (SITTING, 0.45, 0.8, 180, "On the person's left, beside the hips, with them on its left."),
        (SITTING, 2.0, 0.1, 0, "In front of the person, facing away."),
        (SITTING, -0.6, 0.0, 90, "Behind the person, with them on its right."),
        (LYING, 2.0, 0.0, 180, "At the person's feet, facing them."),
        (LYING, -0.6, 0.0, 0, "At the person's head, facing them."),
        (LYING, 0.6, 0.1, 0, "Where the person is, with them on its right."),
    ],
)
def test_text(frames, x, y, yaw_deg, text):
    assert relative_place(x, y, math.radians(yaw_deg), frames).text == text


@pytest.mark.parametrize("turn_deg", [30, 90, 200])
def test_moving_room_and_robot_together_changes_nothing(turn_deg):
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    moved = {n: (c * x - s * y + 3.0, s * x + c * y - 1.0, z) for n, (x, y, z) in SITTING.items()}
    for x, y, yaw in ((0.9, -0.8, 0.3), (2.0, 0.2, 2.0), (-0.6, 0.1, 4.0), (0.3, 0.9, 5.0)):
        there = (c * x - s * y + 3.0, s * x + c * y - 1.0, yaw + math.radians(turn_deg))
        assert relative_place(*there, moved) == relative_place(x, y, yaw, SITTING)


def test_without_a_person_there_is_no_place():
    assert relative_place(0.0, 0.0, 0.0, {}) is None
    assert relative_place(0.0, 0.0, 0.0, {"head": (0.0, 0.0, 1.0)}) is None


def test_stops_are_sentences_and_those_without_a_place_are_left_out():
    places = ["On the person's right, beside the knees, facing them.", ""]
    assert stop_places(places) == ["Stop 1: on the person's right, beside the knees, facing them."]
