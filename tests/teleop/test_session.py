from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcs.errors import TcsError
from tcs.teleop import Command, Mode, Settings, Teleoperation, load_arm
from tcs.teleop.control import rotation_vector

STEP = Settings().acceleration * Settings().period
# Rates are sums of hundreds of steps, each rounded to 1e-16.
ROUNDING = 1e-12
BOTH = ["paper", "clamped"]


def drive(session, command, seconds):
    """Return the steps of a while under one command."""
    return [session.step(command) for _ in range(round(seconds / session.settings.period))]


def off(steps, p):
    """Return how far the tool went from a place [m]."""
    return max(float(np.linalg.norm(step.p - p)) for step in steps)


class TestEndEffector:
    def test_the_tool_moves_as_it_is_asked_to(self, iiwa, ready):
        session = Teleoperation(iiwa, ready)
        start = session.step(Command())
        steps = drive(session, Command(linear=(0.05, 0.03, -0.02), angular=(0, 0.1, 0.2)), 2.0)
        moved = steps[-1].p - start.p
        # It runs behind while it gathers speed, in 0.05 s, and makes up for that.
        np.testing.assert_allclose(moved, [0.1, 0.06, -0.04], atol=1e-4)
        turned = rotation_vector(steps[-1].R @ start.R.T)
        np.testing.assert_allclose(turned, [0.0, 0.2, 0.4], atol=2e-3)
        assert not any(step.stopped for step in steps)

    def test_without_a_command_the_arm_does_not_move(self, iiwa, ready):
        steps = drive(Teleoperation(iiwa, ready), Command(), 1.0)
        assert not any(step.rates.any() for step in steps)
        np.testing.assert_array_equal(steps[-1].joints, ready)

    def test_too_fast_a_command_is_followed_slower_in_the_same_direction(self, iiwa, ready):
        session = Teleoperation(iiwa, ready)
        start = session.step(Command())
        steps = drive(session, Command(linear=(0.0, 3.0, 0.0)), 0.3)
        assert all((np.abs(step.rates) <= iiwa.velocity + ROUNDING).all() for step in steps)
        moved = steps[-1].p - start.p
        assert moved[1] > 0.1
        # The target gives way to the tool on its leash, so what the first steps leave stays.
        assert np.hypot(moved[0], moved[2]) < 0.03 * moved[1]

    def test_paper_ends_the_motion_at_a_limit_and_the_way_back_is_open(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, Settings(limits="paper"))
        steps = drive(session, Command(linear=(-0.1, 0.0, 0.0)), 6.0)
        last = steps[-1]
        assert last.stopped
        assert last.reason == "joint 4 is at its limit: motion ends there."
        assert last.limits.tolist() == [0, 0, 0, -1, 0, 0, 0]
        assert last.joints[3] == pytest.approx(iiwa.lower[3], abs=1e-9)
        assert np.abs(last.rates).max() < 1e-9
        back = drive(session, Command(linear=(0.1, 0.0, 0.0)), 0.5)
        assert not back[0].stopped
        # It gathers speed in 0.05 s.
        assert back[-1].p[0] - last.p[0] > 0.045

    @pytest.mark.parametrize("limits", BOTH)
    def test_a_joint_at_its_limit_that_is_not_needed_stops_nothing(self, iiwa, ready, limits):
        joints = ready.copy()
        joints[6] = iiwa.upper[6]
        for mode in (Mode.END_EFFECTOR, Mode.NULL_SPACE):
            session = Teleoperation(iiwa, joints, Settings(limits=limits), mode)
            steps = drive(session, Command(linear=(0.05, 0, 0.05), group=1, sign=-1), 0.5)
            assert not any(step.stopped for step in steps)
            assert np.abs(steps[-1].joints - joints)[:6].max() > 0.02

    def test_clamped_leaves_the_joint_at_its_limit_and_goes_on(self, iiwa):
        # Elbow nearly at its limit, the rest bent so that six joints can do it all.
        joints = np.array([0.3, 0.4, 0.6, -2.05, -0.7, 0.8, 0.0])
        session = Teleoperation(iiwa, joints)
        start = session.step(Command())
        command = Command(angular=(0.0, 0.0, 0.3), linear=(0.0, 0.03, 0.0))
        steps = drive(session, command, 1.0)
        np.testing.assert_allclose(steps[-1].p - start.p, [0, 0.03, 0], atol=2e-3)

    def test_clamped_says_when_nothing_goes_on(self, iiwa):
        # Joint 6 and the shoulder are all that could lift a stretched arm any farther.
        session = Teleoperation(iiwa, np.array([0.0, 0.8, 0, -0.4, 0, 0.4, 0]))
        steps = drive(session, Command(linear=(0.5, 0.0, -0.5)), 3.0)
        assert all((iiwa.beyond(step.joints) == "") for step in steps)


class TestNullSpace:
    @pytest.mark.parametrize("limits", BOTH)
    def test_joint_1_sweeps_60_degrees_and_the_tool_stays(self, iiwa, ready, limits):
        joints = ready.copy()
        session = Teleoperation(iiwa, joints, Settings(limits=limits), Mode.NULL_SPACE)
        drive(session, Command(group=0, sign=-1), 1.6)
        start = session.step(Command(group=0))
        steps = drive(session, Command(group=0), 0.5)
        while steps[-1].joints[0] - start.joints[0] < np.radians(60.0):
            steps += drive(session, Command(group=0, sign=1), 0.05)
            assert not steps[-1].stopped
        steps += drive(session, Command(group=0), 0.5)
        # 0.1 mm is the bar; a hundredth of it is seen.
        assert off(steps, start.p) < 1e-4 / 10
        outside = np.array([step.rates[3:] for step in steps])
        # All that is left to the others is to undo the drift.
        assert np.abs(outside).max() < 1e-3

    @pytest.mark.parametrize("group", range(4))
    @pytest.mark.parametrize("sign", [1, -1])
    @pytest.mark.parametrize("limits", BOTH)
    def test_the_tool_stays_until_the_group_can_go_no_further(
        self, iiwa, ready, limits, sign, group
    ):
        session = Teleoperation(iiwa, ready + 0.1, Settings(limits=limits), Mode.NULL_SPACE)
        start = session.step(Command())
        steps = drive(session, Command(group=group, sign=sign), 9.0)
        assert off(steps, start.p) < 1e-4
        assert steps[-1].stopped
        assert steps[-1].reason
        lead = session.settings.groups[group][0]
        assert sign * (steps[-1].joints[lead] - ready[lead] - 0.1) > 0.05
        # And back again.
        back = drive(session, Command(group=group, sign=-sign), 3.0)
        assert off(back, start.p) < 1e-4
        assert sign * (back[-1].joints[lead] - steps[-1].joints[lead]) < -0.05

    def test_the_lead_joint_turns_at_the_rate_of_its_group(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, mode=Mode.NULL_SPACE)
        steps = drive(session, Command(group=0, sign=1), 1.0)
        # 1 % slower where all joints turn as fast as it does, as in `_ease`.
        assert steps[-1].rates[0] == pytest.approx(session.settings.group_rate, rel=0.02)
        assert not np.abs(steps[-1].rates[3:]).max() > 1e-6

    @pytest.mark.parametrize("name", ["pr2", "tiago", "panda"])
    def test_other_arms_hold_their_tools_too(self, name):
        arm = load_arm(name)
        lower, upper = (np.where(arm.bounded, x, 0.0) for x in (arm.lower, arm.upper))
        session = Teleoperation(arm, 0.5 * (lower + upper), mode=Mode.NULL_SPACE)
        start = session.step(Command())
        for group in range(4):
            for sign in (1, -1):
                steps = drive(session, Command(group=group, sign=sign), 2.0)
                assert off(steps, start.p) < 1e-4

    @pytest.mark.parametrize("name", ["iiwa7", "pr2_right", "tiago", "panda"])
    def test_from_anywhere_past_whatever_limits_the_tool_stays(self, name, rng):
        arm = load_arm(name)
        for joints in arm.random_joints(rng, 10):
            session = Teleoperation(arm, joints, mode=Mode.NULL_SPACE)
            start = session.step(Command())
            command = Command(group=int(rng.integers(3)), sign=int(rng.choice([-1, 1])))
            # 0.08 mm is the most that 240 such motions have shown.
            assert off(drive(session, command, 2.0), start.p) < 1e-4

    def test_a_turn_command_does_nothing_to_the_tool(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, mode=Mode.NULL_SPACE)
        steps = drive(session, Command(linear=(0.2, 0, 0), angular=(0, 1, 0)), 0.5)
        np.testing.assert_array_equal(steps[-1].joints, ready)


class TestPose:
    def test_the_elbow_turns_and_the_whole_pose_stays(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, mode=Mode.POSE)
        start = session.step(Command())
        steps = drive(session, Command(sign=1), 3.0)
        assert off(steps, start.p) < 1e-5
        assert max(np.linalg.norm(rotation_vector(s.R @ start.R.T)) for s in steps) < 1e-4
        assert steps[-1].joints[0] - start.joints[0] > 0.1

    def test_it_ends_at_a_limit_and_turns_back(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, mode=Mode.POSE)
        start = session.step(Command())
        steps = drive(session, Command(sign=1), 15.0)
        assert "is at its limit: the elbow's motion ends there." in steps[-1].reason
        assert np.abs(steps[-1].limits).sum() == 1
        steps += drive(session, Command(sign=-1), 5.0)
        assert not steps[-1].stopped
        assert off(steps, start.p) < 1e-4


@pytest.mark.parametrize("mode", [Mode.ASSISTED, Mode.DRAKE])
class TestAssisted:
    def test_the_tool_moves_as_it_is_asked_to(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready, mode=mode)
        start = session.step(Command())
        steps = drive(session, Command(linear=(0.05, 0.03, -0.02)), 2.0)
        np.testing.assert_allclose(steps[-1].p - start.p, [0.1, 0.06, -0.04], atol=1e-3)
        assert np.linalg.norm(rotation_vector(steps[-1].R @ start.R.T)) < 0.02

    def test_no_limit_is_passed(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready, mode=mode)
        for linear in [(-0.3, 0, 0), (0.3, 0.3, 0), (0, 0, 0.4), (0, -0.4, -0.3)]:
            for step in drive(session, Command(linear=linear), 1.5):
                assert iiwa.beyond(step.joints) == ""
                assert (np.abs(step.rates) <= iiwa.velocity + ROUNDING).all()


def follow(session, way, length):
    """Return the steps of somebody who drives along a line without noise, and how far off."""
    start, steps = session.step(Command()), []
    for _ in range(1000):
        gone = (steps[-1] if steps else start).p - start.p
        if gone @ way >= length:
            break
        beside = gone - (gone @ way) * way
        steps.append(session.step(Command(linear=tuple(0.1 * way - 2.0 * beside))))
    gone = np.array([step.p for step in steps]) - start.p
    return steps, np.linalg.norm(gone - np.outer(gone @ way, way), axis=1).max()


def test_the_assistance_goes_on_along_a_line_on_which_a_limit_ends_the_paper_s_motion(iiwa):
    joints = np.array([-1.44, 1.74, -0.76, 1.19, 0.11, 1.0, 1.9])
    way = np.array([np.cos(np.radians(-164.3)), np.sin(np.radians(-164.3)), 0.0])
    found = {}
    for mode, limits in [(Mode.END_EFFECTOR, "paper"), (Mode.ASSISTED, "clamped")]:
        found[mode] = follow(Teleoperation(iiwa, joints, Settings(limits=limits), mode), way, 0.7)
    ended, _ = found[Mode.END_EFFECTOR]
    assert ended[-1].stopped
    steps, beside = found[Mode.ASSISTED]
    assert len(steps) < 1000
    # 0.3 mm is seen; end-effector control that leaves the joint at its limit goes 24 mm astray.
    assert beside < 1e-3


def test_an_assisted_arm_that_nobody_drives_does_not_move(iiwa, ready):
    joints = ready.copy()
    joints[5] = 2.05
    steps = drive(Teleoperation(iiwa, joints, mode=Mode.ASSISTED), Command(), 1.0)
    np.testing.assert_array_equal(steps[-1].joints, joints)


class TestSwitching:
    @settings(max_examples=15, deadline=None)
    @given(seed=st.integers(0, 10**6), limits=st.sampled_from(BOTH))
    def test_no_rate_jumps_whatever_is_asked(self, iiwa, seed, limits):
        rng = np.random.default_rng(seed)
        joints = 0.8 * iiwa.random_joints(rng, 1)[0]
        session = Teleoperation(iiwa, joints, Settings(limits=limits))
        before = np.zeros(7)
        for _ in range(30):
            command = Command(
                linear=tuple(0.3 * rng.normal(size=3)),
                angular=tuple(rng.normal(size=3)),
                group=[None, 0, 1, 2, 3][rng.integers(5)],
                sign=int(rng.integers(-1, 2)),
                mode=list(Mode)[rng.integers(4)],
                clutch=bool(rng.random() < 0.1),
            )
            heard = [command, None] if rng.random() < 0.2 else [command]
            for _ in range(rng.integers(1, 25)):
                step = session.step(heard[-1])
                assert np.abs(step.rates - before).max() <= STEP + ROUNDING
                assert iiwa.beyond(step.joints) == ""
                before = step.rates

    @pytest.mark.parametrize("mode", [Mode.NULL_SPACE, Mode.POSE])
    def test_the_tool_stays_where_it_came_to_rest(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready)
        drive(session, Command(linear=(0.1, 0.1, 0.0)), 1.0)
        steps = drive(session, Command(group=0, sign=1, mode=mode), 3.0)
        # It rolls on while its joints slow down, for less than 0.1 s at 0.14 m/s.
        assert off(steps, steps[0].p) < 0.01
        rest = next(i for i, step in enumerate(steps) if step.time > 1.2)
        assert off(steps[rest:], steps[rest].p) < 1e-5
        assert steps[0].mode == mode

    @pytest.mark.parametrize("mode", [Mode.NULL_SPACE, Mode.POSE])
    def test_nothing_pulls_the_tool_on_to_where_the_target_had_run_ahead(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready)
        last = session.step(Command(linear=(3.0, 0.0, 0.0)))
        # The tool has hardly begun to move; its target waits at the end of its leash.
        assert np.linalg.norm(last.target_p - last.p) == pytest.approx(0.005)
        # What takes one step to begin takes one to end; a pull to the target takes 1 mm.
        assert off(drive(session, Command(mode=mode), 1.0), last.p) < 1e-5

    def test_a_group_comes_to_rest_before_the_tool_moves(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, mode=Mode.NULL_SPACE)
        start = session.step(Command())
        drive(session, Command(group=0, sign=1), 1.0)
        steps = drive(session, Command(linear=(0.1, 0, 0), mode=Mode.END_EFFECTOR), 1.0)
        modes = [step.mode for step in steps]
        waiting = modes.count(Mode.NULL_SPACE)
        assert 0 < waiting < 50
        assert modes == [Mode.NULL_SPACE] * waiting + [Mode.END_EFFECTOR] * (100 - waiting)
        assert off(steps[:waiting], start.p) < 1e-5

    def test_another_group_begins_once_the_first_has_come_to_rest(self, iiwa, ready):
        session = Teleoperation(iiwa, ready + 0.1, mode=Mode.NULL_SPACE)
        start = session.step(Command())
        steps = drive(session, Command(group=0, sign=1), 1.0)
        steps += drive(session, Command(group=1, sign=-1), 1.0)
        assert off(steps, start.p) < 1e-5
        assert steps[-1].rates[1] < -0.05

    def test_the_clutch_parts_person_and_arm(self, iiwa, ready):
        session = Teleoperation(iiwa, ready)
        drive(session, Command(linear=(0.1, 0, 0)), 1.0)
        steps = drive(session, Command(linear=(0.1, 0, 0), clutch=True), 1.0)
        assert not steps[-1].rates.any()
        assert not steps[-1].stopped
        np.testing.assert_array_equal(steps[-1].target_p, steps[-1].p)
        again = drive(session, Command(linear=(0.1, 0, 0)), 0.2)
        assert again[-1].p[0] > steps[-1].p[0]

    def test_the_target_is_never_far_from_the_tool(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, Settings(limits="clamped"))
        for step in drive(session, Command(linear=(-0.5, 0, 0), angular=(0, 3.0, 0)), 3.0):
            assert np.linalg.norm(step.target_p - step.p) <= session.settings.leash + ROUNDING
            turned = np.linalg.norm(rotation_vector(step.target_R @ step.R.T))
            assert turned <= session.settings.leash_angle + 1e-9


class TestBadInput:
    @pytest.mark.parametrize(
        ("command", "said"),
        [
            (Command(linear=(np.nan, 0, 0)), "its linear velocity must be finite, and 100 m/s at"),
            (Command(angular=(0, np.inf, 0)), "its angular velocity must be finite, and 100 rad/s"),
            (Command(linear=(0, 0, -1e9)), "its linear velocity must be finite, and 100 m/s at"),
            (Command(linear=(0, 0)), "its linear velocity must be 3 numbers [m/s]"),
            (Command(angular="fast"), "its angular velocity must be 3 numbers [rad/s]"),
            (
                Command(mode="elbow"),
                "there is no mode 'elbow', only end-effector, null-space, pose",
            ),
            (Command(group=4, sign=1), "there is no joint group 4, only 0 to 3"),
            (Command(group=0, sign=2), "its sign must be -1, 0 or 1, not 2"),
            (Command(group=0, sign=np.nan), "its sign must be -1, 0 or 1, not nan"),
        ],
        ids=["nan", "inf", "huge", "short", "text", "mode", "group", "sign", "nan sign"],
    )
    @pytest.mark.parametrize("mode", [Mode.END_EFFECTOR, Mode.NULL_SPACE, Mode.ASSISTED])
    def test_the_arm_holds_still_and_says_why(self, iiwa, ready, mode, command, said):
        session = Teleoperation(iiwa, ready, mode=mode)
        drive(session, Command(linear=(0.1, 0, 0), group=0, sign=1), 1.0)
        steps = drive(session, command, 1.0)
        assert all(step.stopped for step in steps)
        assert steps[0].reason.startswith(f"command refused: {said}")
        assert "\n" not in steps[0].reason
        assert not steps[-1].rates.any()
        rates = np.array([step.rates for step in steps])
        assert np.abs(np.diff(rates, axis=0)).max() <= STEP + ROUNDING
        # What was asked before does not come back by itself.
        # Where the tool is held, a drift of less than a micrometre is being undone.
        assert np.abs(drive(session, None, 0.1)[-1].rates).max() < 1e-5
        fine = session.step(Command(linear=(0.1, 0, 0), group=0, sign=1))
        assert not fine.stopped

    def test_a_lost_input_stops_the_arm(self, iiwa, ready):
        session = Teleoperation(iiwa, ready)
        drive(session, Command(linear=(0.1, 0, 0)), 1.0)
        silent = drive(session, None, 1.0)
        # 0.25 s, of which the step that was last heard is none.
        assert [step.stopped for step in silent] == [False] * 25 + [True] * 75
        assert silent[-1].reason.startswith("input lost: no command for more than 0.25 s.")
        assert not silent[-1].rates.any()
        assert not session.step(Command()).stopped

    def test_a_session_that_hears_nothing_says_so(self, iiwa, ready):
        assert drive(Teleoperation(iiwa, ready), None, 0.3)[-1].reason.startswith("input lost")

    @pytest.mark.parametrize("mode", list(Mode))
    def test_a_start_beyond_the_limits_is_held(self, iiwa, ready, mode):
        joints = ready.copy()
        joints[3] = -2.2
        session = Teleoperation(iiwa, joints, mode=mode)
        step = drive(session, Command(linear=(0.1, 0, 0), group=0, sign=1), 0.5)[-1]
        assert step.stopped
        assert step.reason.startswith("start posture: joint 4 ('iiwa_joint_4') is at -2.2000 rad")
        np.testing.assert_array_equal(step.joints, joints)
        assert not step.rates.any()
        session.place(ready)
        assert not session.step(Command()).stopped

    def test_a_start_that_is_no_posture_is_refused(self, iiwa):
        with pytest.raises(TcsError, match="start posture: must be 7 finite numbers"):
            Teleoperation(iiwa, [0.0] * 6)


class TestFlags:
    def test_joints_at_their_limits_are_flagged_with_their_side(self, iiwa, ready):
        joints = ready.copy()
        joints[3], joints[5] = iiwa.lower[3] + 0.005, iiwa.upper[5] - 0.005
        step = Teleoperation(iiwa, joints).step(Command())
        assert step.limits.tolist() == [0, 0, 0, -1, 0, 1, 0]
        assert step.worst_joint in (3, 5)

    def test_a_stretched_arm_is_singular(self, iiwa, ready):
        assert Teleoperation(iiwa, np.zeros(7)).step(Command()).singular
        step = Teleoperation(iiwa, ready).step(Command())
        assert not step.singular
        assert step.singular_value > 0.05

    def test_a_shoulder_and_a_wrist_that_are_straight_are_singular_for_the_pose_alone(
        self, iiwa, ready
    ):
        joints = ready.copy()
        joints[[1, 5]] = 0.0
        assert Teleoperation(iiwa, joints).step(Command()).singular
        assert not Teleoperation(iiwa, joints, mode=Mode.NULL_SPACE).step(Command()).singular

    def test_paper_ends_the_motion_at_a_singularity_and_the_way_back_is_open(self, iiwa, ready):
        session = Teleoperation(iiwa, ready, Settings(limits="paper"))
        last = drive(session, Command(linear=(0.2, 0, 0.1)), 5.0)[-1]
        assert last.reason == "the arm is singular: motion ends there."
        assert last.singular
        back = drive(session, Command(linear=(-0.2, 0, -0.1)), 1.0)
        assert not back[-1].stopped
        assert np.linalg.norm(back[-1].p - last.p) > 0.1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"period": 0.0}, "period is 0.0, but must be finite and above 0"),
        ({"gain": np.nan}, "gain is nan, but must be finite and above 0"),
        ({"gain": 200.0}, "Keep the gain at most 100"),
        ({"damping": -1.0}, "damping is -1.0, but must be finite and 0 or more"),
        ({"limits": "soft"}, "must be 'paper' or 'clamped'"),
        ({"groups": ((0, 7),)}, "must name joints 0 to 6"),
        ({"groups": ((),)}, "must name joints 0 to 6"),
        ({"groups": ((1, 1),)}, "each once"),
    ],
)
def test_settings_that_no_arm_can_follow_are_refused(given, said):
    with pytest.raises(TcsError, match=said):
        Settings(**given)
