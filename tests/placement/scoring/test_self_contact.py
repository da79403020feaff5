"""The warning about a pair of robot bodies that refuses most goals."""

from __future__ import annotations

import logging

import pytest

from tcs.model.robots import load_robot
from tcs.placement.scoring import score, summary


@pytest.fixture(scope="module")
def robot():
    return load_robot("pr2")


def test_a_pair_that_touches_in_every_posture_is_named(small_environment, robot, caplog):
    # Palm and wrist are 1.7 mm apart in every posture.
    wide = robot.model_copy(update={"self_margin": 0.002})
    with caplog.at_level(logging.WARNING):
        file = score("shaving", small_environment, wide, paper=True)
    found = summary(file)["self_contact"]
    assert found["bodies"] == ["l_wrist_flex_link", "l_gripper_palm_link"]
    assert found["reached"] == 0
    assert found["refused"] == summary(file)["reasons"]["arm_blocked"] > 100
    (record,) = [r for r in caplog.records if r.name.startswith("tcs.placement.scoring")]
    assert "self_margin (0.002 m)." in record.getMessage()
    assert "\n" not in record.getMessage()


def test_under_other_limits_the_message_points_to_them(small_environment, robot, caplog):
    groups = tuple(
        group.model_copy(update={"limits": "soft"}) if "cannot meet" in group.reason else group
        for group in robot.disabled_groups
    )
    unproven = robot.model_copy(update={"disabled_groups": groups, "limits": "hard"})
    with caplog.at_level(logging.WARNING):
        file = score("shaving", small_environment, unproven, paper=True)
    found = file.metadata["self_contact"]
    assert found["refused"] > found["reached"]
    assert "limits: hard" in caplog.text


def test_a_robot_that_moves_freely_is_not_warned_of(small_file, caplog):
    assert summary(small_file)["self_contact"] is None
    assert not caplog.records
