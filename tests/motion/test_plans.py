"""Whole plans: what the segments are, that they are continuous and repeatable, and their files."""

from __future__ import annotations

import csv
import itertools
import json
import re

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import tcs
from tcs.errors import OutputError, TcsError
from tcs.kernel.motion.edges import certified
from tcs.model.scene import NeighbourList
from tcs.model.tasks import TOOL_SPEED
from tcs.motion import Stop, recheck, save_plan
from tcs.motion.recheck import false_pieces
from tcs.motion.stop_tour import _Tour
from tcs.output.terminal.set_tables import report_plan
from tcs.placement.scoring.rebuild import rebuild_scenes


@pytest.fixture(scope="module")
def stop(two_goals):
    job, scene, _ = rebuild_scenes(tcs.load(two_goals))[0]
    return Stop.of(job, scene, 0, seed=0)


def test_the_arm_goes_from_rest_straight_in_and_out_and_back(planned, stop):
    (at_stop,) = planned.stops
    segments = at_stop.segments
    assert [segment.type for segment in segments] == ["move", "approach", "retreat", "move"]
    assert [(s.start, s.end) for s in segments] == [(None, 0), (0, 0), (0, 0), (0, None)]
    np.testing.assert_array_equal(segments[0].timing.positions[0], stop.rest)
    np.testing.assert_array_equal(segments[-1].timing.positions[-1], stop.rest)
    for before, after in itertools.pairwise(segments):
        np.testing.assert_allclose(
            before.timing.positions[-1], after.timing.positions[0], atol=1e-12
        )
        assert not np.any([before.timing.velocities[-1], after.timing.velocities[0]])
    assert at_stop.returns
    assert at_stop.goals == (0,)


def test_the_motion_back_to_rest_takes_full_turns_back(stop):
    tour = _Tour(stop, 0, np.full(7, np.inf))
    turns = np.where(stop.motion.limits.period > 0.0, 2.0 * np.pi, 0.0)
    tour.q, tour.goal = stop.rest + turns, 0
    assert (np.count_nonzero(turns), tour.go_home()) == (2, True)
    (home,) = tour.segments
    np.testing.assert_array_equal(home.timing.positions[0], stop.rest + turns)
    np.testing.assert_array_equal(home.timing.positions[-1], stop.rest)


def test_a_plan_of_one_stop_reports_its_progress_and_can_be_cancelled(two_goals):
    class Cancelled(Exception):
        pass

    def progress(at_most):
        seen = []

        def on_progress(done, total):
            seen.append((done, total))
            if len(seen) == at_most:
                raise Cancelled

        tcs.plan(tcs.load(two_goals), [0], seed=3, on_progress=on_progress)
        return seen

    for at_most in (1, 3):
        with pytest.raises(Cancelled):
            progress(at_most)
    seen = progress(None)
    done = [one for one, _ in seen]
    assert done == sorted(done)
    assert (seen[0][0] < 30, seen[-1]) == (True, (100, 100))
    # Two goals approached, one visited, four motions checked, and the stop.
    assert len(seen) == 8


def test_goals_that_cannot_be_done_say_why(planned):
    done, limited = planned.results
    assert done.done
    assert (limited.done, limited.reason) == (False, "approach_limits")
    assert limited.segment == "approach of goal 2"
    assert planned.goals_done == 1


def test_every_piece_is_certified_and_drake_refutes_none(planned, stop):
    assert (planned.edges > 40, planned.false) == (True, 0)
    for segment in planned.stops[0].segments:
        # Straight motions may enter the boxes that paths keep out of.
        is_path = segment.type == "move"
        scene = (stop.motion, stop.work) if is_path else (stop.lines, stop.line_work)
        curve = segment.curve
        for piece in range(curve.pieces):
            assert certified(*scene, curve.control_points(piece)) == 1.0


def test_drake_refutes_a_curve_through_the_person(planned, stop):
    approach = planned.stops[0].segments[1].curve
    # 30 cm beyond the goal, the tool would be in the head.
    beyond = approach.shifted(3.0 * (approach.q[-1] - approach.q[0]))
    neighbours = NeighbourList(stop.scene)
    assert false_pieces(neighbours, stop.motion, approach) == 0
    assert false_pieces(neighbours, stop.motion, beyond) > 0


def test_drake_checks_at_most_a_step_of_motion_apart(planned, stop):
    for segment in planned.stops[0].segments:
        curve = segment.curve
        for piece in range(curve.pieces):
            at = recheck.dense_fractions(stop.motion, curve, piece)
            assert (at[0], at[-1]) == (0.0, 1.0)
            corners = recheck.shape_corners(stop.motion, curve.points(piece, at))
            steps = np.linalg.norm(np.diff(corners, axis=0), axis=2).max(axis=1)
            assert steps.max() <= recheck.LARGEST_STEP


def test_every_limit_holds_between_samples(planned, stop):
    lower, upper = stop.scene.arm_limits
    for segment in planned.stops[0].segments:
        timing = segment.timing
        spline = CubicHermiteSpline(timing.times, timing.positions, timing.velocities)
        at = np.linspace(0.0, timing.duration, 20_000)
        assert np.all((spline(at) >= lower - 1e-12) & (spline(at) <= upper + 1e-12))
        assert np.all(np.abs(spline(at, 1)) <= stop.velocity * (1.0 + 1e-9))
        assert np.all(np.abs(spline(at, 2)) <= stop.acceleration * (1.0 + 1e-9))
        if segment.type == "move":
            continue
        fastest = 0.0
        for q, v in zip(spline(at[::20]), spline(at[::20], 1), strict=True):
            stop.scene.set_arm(q)
            fastest = max(fastest, float(np.linalg.norm(stop.scene.tool_jacobian()[3:] @ v)))
        assert 0.99 * TOOL_SPEED < fastest <= TOOL_SPEED


def test_the_same_seed_gives_the_same_plan_of_the_best_set(planned, two_goals, tcs_plan, tmp_path):
    out = tmp_path / "plan.csv"
    ran = tcs_plan(two_goals, "--seed", 3, "--out", out, "--json")
    assert ran.exit_code == 0
    printed = json.loads(ran.stdout)
    expected = json.loads(json.dumps(planned.to_json()))
    for plain in (expected, printed):
        del plain["seconds"]
        for result in plain["results"]:
            result.pop("seconds", None)
    assert printed == expected
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert len(rows) == sum(len(s.timing.times) for s in planned.stops[0].segments)
    assert {"stop", "segment", "type", "from", "to", "time", *planned.joints} <= set(rows[0])
    times = [float(row["time"]) for row in rows]
    assert times == sorted(times)


def test_json_has_the_promised_keys(planned, tmp_path):
    path = tmp_path / "plan.json"
    save_plan(path, planned)
    plain = json.loads(path.read_text())
    assert {"stops", "goals", "goals_done", "verified", "seconds"} <= set(plain)
    assert set(plain["verified"]) == {"edges", "false"}
    assert (plain["goals"], plain["goals_reached"], plain["goals_done"]) == (2, 2, 1)
    segment = plain["stops"][0]["segments"][0]
    assert (segment["from"], segment["to"]) == ("rest", 0)
    assert np.shape(segment["positions"]) == (len(segment["times"]), 7)


def test_other_formats_and_configurations_are_refused(planned, two_goals, tcs_plan, tmp_path):
    with pytest.raises(OutputError, match=r"\.json, \.csv, \.yaml, \.ros1\.yaml or \.npz"):
        save_plan(tmp_path / "plan.txt", planned)
    with pytest.raises(TcsError, match="no configuration 1; the file has 1"):
        tcs.plan(tcs.load(two_goals), [1])
    assert tcs_plan(two_goals, "--configuration", 1).exit_code == 2
    assert tcs_plan(two_goals, "--configuration", 0, "--max-members", 1).exit_code == 2


def test_the_text_names_motions_and_reasons(planned, capsys):
    report_plan(planned.to_json())
    text = capsys.readouterr().out
    assert re.search(r"approach +goal 1 +goal 1", text)
    assert "goal 2: joint or velocity limits prevent its approach" in text
    assert "1 of 2 goals done (2 reached by a posture)" in text


def test_a_blocked_path_names_the_pair(planned, capsys):
    result = planned.to_json()
    result["results"][1] |= {"reason": "no_path", "pair": ["l_forearm_link", "person::head"]}
    result["stops"][0]["returns"] = False
    report_plan(result)
    text = capsys.readouterr().out
    assert "most often l forearm against head" in text
    assert "no path back" in text
