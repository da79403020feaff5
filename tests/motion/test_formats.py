"""Plans in other formats, in the given order, and from a base pose off the grid."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
import yaml
from pydrake.trajectories import PiecewisePolynomial

import tcs
from tcs.errors import TcsError, UnknownNameError
from tcs.motion import save_plan
from tcs.motion.tour import EXACT, REST, best_tour, given_tour


def test_drake_loads_the_arrays(planned, tmp_path):
    save_plan(tmp_path / "plan.npz", planned)
    saved = np.load(tmp_path / "plan.npz")
    trajectory = PiecewisePolynomial.CubicHermite(
        saved["breaks_0"], saved["samples_0"], saved["samples_dot_0"]
    )
    (stop,) = planned.stops
    assert trajectory.end_time() == pytest.approx(stop.duration)
    assert saved["joints"].tolist() == list(planned.joints)
    begin = 0.0
    for segment in stop.segments:
        q = trajectory.value(begin + 0.5 * segment.timing.duration)[:, 0]
        timing = segment.timing
        near = np.argmin(np.abs(timing.times - 0.5 * timing.duration))
        assert np.max(np.abs(q - timing.positions[near])) < 0.1
        begin += timing.duration
    # The arm is back at rest, not a full turn away.
    np.testing.assert_allclose(
        trajectory.value(begin)[:, 0], stop.samples().positions[0], atol=1e-9
    )


def test_ros_messages_have_one_point_for_each_sample(planned, tmp_path):
    save_plan(tmp_path / "plan.yaml", planned)
    (message,) = yaml.safe_load_all((tmp_path / "plan.yaml").read_text())
    assert message["joint_names"] == list(planned.joints)
    samples = planned.stops[0].samples()
    assert len(message["points"]) == len(samples.times)
    seconds = []
    for point, q in zip(message["points"], samples.positions, strict=True):
        assert {len(point[key]) for key in ("positions", "velocities")} == {7}
        # With accelerations, controllers would follow quintics, which are another curve.
        assert point["accelerations"] == []
        np.testing.assert_array_equal(point["positions"], q)
        at = point["time_from_start"]
        assert 0 <= at["nanosec"] < 10**9
        seconds.append(at["sec"] + 1e-9 * at["nanosec"])
    assert np.all(np.diff(seconds) > 0.0)
    assert seconds[0] == 0.0
    np.testing.assert_allclose(seconds, samples.times, rtol=0.0, atol=1e-12)


def test_messages_of_ros_1_differ_in_times_and_header_alone(planned, tmp_path):
    save_plan(tmp_path / "plan.yaml", planned)
    save_plan(tmp_path / "plan.ros1.yaml", planned)
    (second,) = yaml.safe_load_all((tmp_path / "plan.yaml").read_text())
    (first,) = yaml.safe_load_all((tmp_path / "plan.ros1.yaml").read_text())
    stamp = {"secs": 0, "nsecs": 0}
    assert first.pop("header") == {"seq": 0, "stamp": stamp, "frame_id": ""}
    assert second.pop("header") == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    for one, two in zip(first["points"], second["points"], strict=True):
        at, also = one.pop("time_from_start"), two.pop("time_from_start")
        assert at == {"secs": also["sec"], "nsecs": also["nanosec"]}
    assert first == second


def circle(count, rng):
    """Return goals on a circle in random order with a posture off it, and the costs."""
    angles = 2 * np.pi * rng.permutation(count) / count
    at = [np.array([[3 * np.cos(a), 3 * np.sin(a)], [np.cos(a), np.sin(a)]]) for a in angles]
    rest = np.array([[1.0, 0.0]])

    def leg(a, b):
        start, end = (rest if g == REST else at[g] for g in (a, b))
        return np.linalg.norm(start[:, None] - end[None], axis=2)

    return angles, leg


def cost(tour, leg):
    ways = [(REST, 0), *tour, (REST, 0)]
    return sum(leg(a, b)[p, q] for (a, p), (b, q) in itertools.pairwise(ways))


def test_more_goals_than_are_searched_exactly_go_round_the_circle(rng):
    count = EXACT + 3
    _, leg = circle(count, rng)
    tour = best_tour([2] * count, leg)
    assert sorted(goal for goal, _ in tour) == list(range(count))
    assert {posture for _, posture in tour} == {1}
    # A regular polygon through all goals; one of them is at rest.
    assert cost(tour, leg) == pytest.approx(count * 2 * np.sin(np.pi / count))


def test_goals_in_their_own_order_have_the_best_postures(rng):
    _, leg = circle(6, rng)
    tour = given_tour([2] * 6, leg)
    assert tour == tuple((goal, 1) for goal in range(6))
    assert given_tour([], leg) == ()


def test_a_plan_from_a_base_pose_off_the_grid(two_goals, tcs_plan):
    ran = tcs_plan(
        two_goals, "--here", 0.61, -0.89, 44, "--torso", 0.29, "--exactly", "--order", "given",
        "--json",
    )  # fmt: skip
    assert ran.exit_code == 0, ran.stderr
    plan = json.loads(ran.stdout)
    (stop,) = plan["stops"]
    assert (stop["configuration"], stop["base_x"], stop["base_yaw_deg"]) == (None, 0.61, 44.0)
    assert plan["goals_reached"] == 2
    assert plan["results"][0]["done"]
    assert plan["verified"]["false"] == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--exactly",), "--here"),
        (("--at", "bed_height=1"), "--exactly"),
        (("--order", "random"), "order"),
        (("--out", "plan.bag"), ".npz"),
    ],
)
def test_misuse_is_one_line(two_goals, tcs_plan, words, message):
    ran = tcs_plan(two_goals, *words)
    assert ran.exit_code in (1, 2)
    assert message in " ".join(str(ran.exception or "").split()) + ran.output + ran.stderr


def test_states_and_orders_are_checked(two_goals):
    file = tcs.load(two_goals)
    with pytest.raises(UnknownNameError, match="order"):
        tcs.plan(file, [0], order="shortest")
    with pytest.raises(TcsError, match="no configuration 1; the file has 1"):
        tcs.plan(file, [1])
