"""The experiment's line: it meets the conditions of the search."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.teleop import Command, Mode, Settings, Teleoperation, load_arm
from tcs_studies.experiment import course as course_module
from tcs_studies.experiment.course import BLOCKED_AFTER, BLOCKING, find_course

SETTINGS = Settings(limits="paper")
SPEED = 0.06


def go(session, line, seconds):
    """Follow the line without noise until the arm stops or the end is reached."""
    step = session.step(Command())
    for _ in range(int(seconds / SETTINGS.period)):
        aim = line.at(min(1.0, float(line.fraction_at(step.p)) + 0.1)) - step.p
        step = session.step(
            Command(linear=SPEED * aim / np.linalg.norm(aim), mode=Mode.END_EFFECTOR)
        )
        if step.stopped or np.linalg.norm(step.p - line.end) < 0.01:
            break
    return step


def check(arm, course):
    line = course.line
    start = arm.kinematics(course.joints)
    np.testing.assert_allclose(start.p, line.start, atol=1e-9)
    assert line.start[0] > line.end[0]
    assert line.start[2] == pytest.approx(line.end[2])
    session = Teleoperation(arm, course.joints, SETTINGS)
    step = go(session, line, 60.0)
    # The session brakes on its way into the limit; the search takes steps of 4 mm.
    assert step.stopped
    assert float(line.fraction_at(step.p)) == pytest.approx(BLOCKED_AFTER, abs=0.01)
    assert course.blocking in BLOCKING
    assert step.limits[course.blocking] != 0
    held = step.p
    turn = course.turns[len(course.turns) // 2]
    for _ in range(int(abs(turn) / SETTINGS.group_rate / SETTINGS.period)):
        step = session.step(Command(group=0, sign=int(np.sign(turn)), mode=Mode.NULL_SPACE))
        assert not step.stopped
        assert np.linalg.norm(step.p - held) < 1e-4
    step = go(session, line, 60.0)
    assert not step.stopped
    np.testing.assert_allclose(step.p, line.end, atol=0.011)


def test_the_line_is_blocked_after_three_quarters_and_group_1_unblocks_it(iiwa, course):
    check(iiwa, course)


def test_the_line_leads_from_the_front_to_the_back(iiwa, course):
    base = iiwa.frames[0, :3, 3]
    assert course.line.start[0] > base[0] + 0.3
    assert course.line.end[0] < base[0]
    assert course.line.length > 0.5


def test_the_same_seed_finds_the_same_line(iiwa, course):
    again = find_course(iiwa)
    assert again.line == course.line
    np.testing.assert_array_equal(again.joints, course.joints)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["tiago", "pr2", "pr2_right", "panda"])
def test_other_arms_have_such_lines(robot):
    arm = load_arm(robot, torso_height=0.15)
    check(arm, find_course(arm))


def test_a_failed_search_is_reported(iiwa, monkeypatch):
    monkeypatch.setattr(course_module, "_TRIED", 3)
    with pytest.raises(TcsError, match=r"no line for 'iiwa7'.*Try another seed"):
        find_course(iiwa)
