from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcs.errors import TcsError
from tcs.teleop import Command, Mode, Settings, Teleoperation
from tcs.teleop.control.resolved_rate import rotation_vector
from tests.teleop.driving import drive, off

STEP = Settings().acceleration * Settings().period
# Rates are sums of hundreds of steps, each rounded to 1e-16.
ROUNDING = 1e-12
BOTH = ["paper", "clamped"]


class TestSwitching:
    @settings(max_examples=15, deadline=None)
    @given(seed=st.integers(0, 10**6), limits=st.sampled_from(BOTH))
    def test_no_rate_jumps_for_any_command(self, iiwa, seed, limits):
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
                assert iiwa.limit_violation(step.joints) == ""
                before = step.rates

    @pytest.mark.parametrize("mode", [Mode.NULL_SPACE, Mode.POSE])
    def test_the_tool_stays_where_it_came_to_rest(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready)
        drive(session, Command(linear=(0.1, 0.1, 0.0)), 1.0)
        steps = drive(session, Command(group=0, sign=1, mode=mode), 3.0)
        # It moves on while its joints slow down, for less than 0.1 s at 0.14 m/s.
        assert off(steps, steps[0].p) < 0.01
        rest = next(i for i, step in enumerate(steps) if step.time > 1.2)
        assert off(steps[rest:], steps[rest].p) < 1e-5
        assert steps[0].mode == mode

    @pytest.mark.parametrize("mode", [Mode.NULL_SPACE, Mode.POSE])
    def test_the_tool_does_not_move_on_to_a_target_ahead_of_it(self, iiwa, ready, mode):
        session = Teleoperation(iiwa, ready)
        last = session.step(Command(linear=(3.0, 0.0, 0.0)))
        # The tool has hardly begun to move; its target waits at the end of its target_lead.
        assert np.linalg.norm(last.target_p - last.p) == pytest.approx(0.005)
        # A motion that starts within one step ends within one; a motion to the target takes 1 mm.
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

    def test_the_clutch_decouples_master_and_slave(self, iiwa, ready):
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
            assert np.linalg.norm(step.target_p - step.p) <= session.settings.target_lead + ROUNDING
            turned = np.linalg.norm(rotation_vector(step.target_R @ step.R.T))
            assert turned <= session.settings.target_lead_angle + 1e-9


class TestBadInput:
    @pytest.mark.parametrize(
        ("command", "said"),
        [
            (Command(linear=(np.nan, 0, 0)), "its linear velocity must be finite, and 100 m/s at"),
            (Command(angular=(0, np.inf, 0)), "its angular velocity must be finite, and 100 rad/s"),
            (Command(linear=(0, 0, -1e9)), "its linear velocity must be finite, and 100 m/s at"),
            (Command(linear=(0, 0)), "its linear velocity must be 3 numbers [m/s]"),
            (Command(linear=(10**400, 0, 0)), "its linear velocity must be 3 numbers [m/s]"),
            (Command(angular="fast"), "its angular velocity must be 3 numbers [rad/s]"),
            (
                Command(mode="elbow"),
                "there is no mode 'elbow', only end-effector, null-space, pose",
            ),
            (Command(group=4, sign=1), "there is no joint group 4, only 0 to 3"),
            (Command(group=0, sign=2), "its sign must be -1, 0 or 1, not 2"),
            (Command(group=0, sign=np.nan), "its sign must be -1, 0 or 1, not nan"),
        ],
        ids=[
            "nan",
            "inf",
            "huge",
            "short",
            "enormous",
            "text",
            "mode",
            "group",
            "sign",
            "nan sign",
        ],
    )
    @pytest.mark.parametrize("mode", [Mode.END_EFFECTOR, Mode.NULL_SPACE, Mode.ASSISTED])
    def test_the_arm_holds_still_and_reports_the_reason(self, iiwa, ready, mode, command, said):
        session = Teleoperation(iiwa, ready, mode=mode)
        drive(session, Command(linear=(0.1, 0, 0), group=0, sign=1), 1.0)
        steps = drive(session, command, 1.0)
        assert all(step.stopped for step in steps)
        assert steps[0].reason.startswith(f"command rejected: {said}")
        assert "\n" not in steps[0].reason
        assert not steps[-1].rates.any()
        rates = np.array([step.rates for step in steps])
        assert np.abs(np.diff(rates, axis=0)).max() <= STEP + ROUNDING
        # The earlier command does not resume.
        # Where the tool is held, a drift of less than a micrometre is being undone.
        assert np.abs(drive(session, None, 0.1)[-1].rates).max() < 1e-5
        fine = session.step(Command(linear=(0.1, 0, 0), group=0, sign=1))
        assert not fine.stopped

    def test_a_lost_input_stops_the_arm(self, iiwa, ready):
        session = Teleoperation(iiwa, ready)
        drive(session, Command(linear=(0.1, 0, 0)), 1.0)
        silent = drive(session, None, 1.0)
        # 0.25 s, not counting the step of the last command.
        assert [step.stopped for step in silent] == [False] * 25 + [True] * 75
        assert silent[-1].reason.startswith("input lost: no command for more than 0.25 s.")
        assert not silent[-1].rates.any()
        assert not session.step(Command()).stopped

    def test_a_session_without_commands_reports_it(self, iiwa, ready):
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

    def test_an_invalid_start_posture_is_refused(self, iiwa):
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

    def test_paper_ends_the_motion_at_a_singularity_and_allows_the_way_back(self, iiwa, ready):
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
