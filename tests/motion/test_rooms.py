"""Rooms: goals count where their motions are found, from any stop, with the distances kept."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

import tcs
from tcs.files.paths import data_folder
from tcs.kernel.motion.search_trees import new_trees
from tcs.model.scene import ErrorDistribution
from tcs.motion import rooms
from tcs.motion.recheck import StopCheck
from tcs.motion.rooms import done_in_rooms, in_rooms
from tcs.motion.stop_tour import plan_stop
from tcs.placement import robustness
from tcs.placement.robustness import PerturbedPoints, Trials, estimation
from tests.environments import CORNER, write_environment

NOTHING = {"person_y": ErrorDistribution(distribution="normal", std=1e-9)}
SAMPLES = 12


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("rooms"), "corner", CORNER)


@pytest.fixture(scope="module")
def file(environment):
    """Shaving from a corner beside the chair, with approach."""
    return tcs.score("shaving", environment, "pr2", jobs=1)


@pytest.fixture(scope="module")
def judged(file):
    """The best set in a dozen rooms."""
    return tcs.evaluate(file, samples=SAMPLES, seed=2, jobs=1)


def test_a_goal_whose_motion_is_blocked_is_reached_but_not_done(tmp_path, environment, file):
    best = file.nominal.sets.best
    free = tcs.evaluate(file, samples=1, select=best, errors=NOTHING, jobs=1)
    assert free.done_by == "motion"
    assert free.done.any()
    # Paths must keep out of a box that holds the head and all approaches; postures need not.
    task = yaml.safe_load((data_folder() / "tasks" / "adl" / "shaving.yaml").read_text())
    task["keep_out"] = [{"body_frame": "head", "position": [0.0, 0.0, 0.0], "box": [1.0, 1.0, 1.0]}]
    path = tmp_path / "walled.yaml"
    path.write_text(yaml.safe_dump(task))
    walled = tcs.score(path, environment, "pr2", jobs=1)
    found = tcs.evaluate(walled, samples=1, select=best, errors=NOTHING, jobs=1)
    assert np.array_equal(found.reached, free.reached)
    assert not found.done.any()
    assert (found.rooms_done, found.summary.mean) == (0.0, 0.0)
    assert found.rooms_done_ci95[0] == 0.0


def test_what_is_done_is_reached_and_what_a_member_does_the_set_does(file, judged):
    assert judged.done_by == "motion"
    assert judged.done.any()
    assert not np.any(judged.done & ~judged.reached)
    complete = judged.reached.all(axis=1)
    for member in judged.sets[0]:
        alone = tcs.evaluate(file, samples=SAMPLES, seed=2, select=[int(member)], jobs=1)
        # Where all goals are reached, hard motions are sought too.
        assert not np.any((alone.done & ~judged.done)[complete])
    plain = judged.to_json()
    assert plain["mean"] == pytest.approx(float((judged.done @ judged.weights).mean()))
    assert plain["rooms_done"] <= plain["complete"]
    low, high = plain["rooms_done_ci95"]
    assert low <= plain["rooms_done"] <= high


def test_the_same_seed_gives_the_same_rooms_and_verdicts(file, judged):
    again = tcs.evaluate(file, samples=SAMPLES, seed=2, jobs=2)
    assert np.array_equal(again.done, judged.done)
    assert np.array_equal(again.offsets["person_y"], judged.offsets["person_y"])
    approached = robustness.evaluate(file, samples=SAMPLES, seed=2, jobs=1)
    assert approached.done_by == "approach"
    assert np.array_equal(approached.reached, judged.reached)
    assert np.array_equal(approached.done, judged.reached)


def test_the_planner_draws_anew_in_each_room(file, monkeypatch):
    begun = {}

    class Visits(rooms._Visits):
        def __init__(self, judge, room, trees):
            super().__init__(judge, room, trees)
            begun[room] = int(trees.random[0])

    monkeypatch.setattr(rooms, "_Visits", Visits)
    for seed in (2, 3):
        tcs.evaluate(file, samples=SAMPLES, seed=seed, jobs=1)
        drawn = {**begun}
        assert len(drawn) > 1
        assert len(set(drawn.values())) == len(drawn)
    # Whatever room came before, and how many are judged.
    tcs.evaluate(file, samples=SAMPLES // 2, seed=3, jobs=2)
    assert begun == drawn


def test_goals_are_done_by_postures_without_approach_and_as_in_the_paper(file, environment):

    found = tcs.evaluate(file, samples=2, jobs=1, body_collisions="paper")
    assert found.done_by == "approach"
    paper = tcs.score("shaving", environment, "pr2", paper=True, jobs=1)
    found = tcs.evaluate(paper, samples=2, jobs=1)
    assert (found.done_by, found.body_collisions) == ("posture", "paper")
    plain = tcs.score("shaving", environment, "pr2", approach=False, jobs=1)
    found = tcs.evaluate(plain, samples=2, jobs=1)
    assert (found.done_by, found.body_collisions) == ("posture", "all")
    assert np.array_equal(found.done, found.reached)


def test_drake_finds_the_motions_of_a_room_free(file):
    """The goals of a room that are done: motions through them, re-checked in that very room."""
    trials = Trials.of(file)
    samples = PerturbedPoints(trials, trials.errors.draw(SAMPLES, 2), 1)
    members = [file.nominal.sets.best[0]]
    points = trials.points(members)
    found = samples.scores(points)
    done = done_in_rooms(samples, points, found, np.arange(SAMPLES), seed=0)
    room = int(np.argmax(done.sum(axis=1)))
    goals = np.flatnonzero(done[room]).tolist()
    assert goals
    (hand,) = trials.hands
    values = dict(zip((axis.name for axis in trials.grid.axes), points[0].tolist(), strict=True))
    grid = in_rooms(samples, hand, {}, np.array([values["torso"]]))
    row = trials.poses(members)._replace(state=np.array([room]), torso=np.array([0]))
    held = {goal: found.joints[0, room, goal].astype(np.float64) for goal in goals}
    stop = grid.stop_at(row, new_trees(0), held)
    stop.place(values)
    for joint, at in samples.positions(hand, {}).items():
        stop.scene.set_joint(joint, float(at[room]))
    assert not stop.resting_contacts()
    planned, results = plan_stop(stop, None, 0, goals)
    assert {result.goal for result in results if result.done} == set(goals)
    check = StopCheck(stop, None)
    assert sum(check.false_pieces(segment) for segment in planned.segments) == 0
    # In another room, the same motions would not all be free: the check can fail.
    stop.scene.set_joint("person_y", float(samples.positions(hand, {})["person_y"][room]) + 0.3)
    moved = StopCheck(stop, None)
    assert sum(moved.false_pieces(segment) for segment in planned.segments) > 0


@pytest.fixture(scope="module")
def estimated(file):
    return tcs.robustify(file, samples=24, sets=20, jobs=1)


def test_the_most_robust_set_is_one_whose_motions_are_judged(file, estimated):
    (settings,) = estimated.metadata["robustness"]
    assert (settings["done_by"], settings["body_collisions"]) == ("motion", "all")
    success = estimated.nominal.success
    assert success.counts_rooms
    best = success.most_robust(estimated.nominal.sets)
    trials = Trials.of(file)
    offsets = trials.errors.draw(24, 0, stream=estimation.ESTIMATION_STREAM)
    samples, points = PerturbedPoints(trials, offsets, 1), trials.points(best)
    done = done_in_rooms(samples, points, samples.scores(points), np.arange(24), seed=0)
    row = success.row_of(best)
    assert success.success[row] == done.all(axis=1).mean()
    approached = robustness.robustify(file, samples=24, sets=20, jobs=1).nominal.success
    assert np.array_equal(approached.members, success.members)
    # Motions take goals away, and add none.
    assert np.all(success.success <= approached.success + 1e-12)


def test_what_robustify_finds_is_selected_evaluated_and_stored(estimated, tmp_path):
    best = estimated.nominal.success.most_robust(estimated.nominal.sets)
    choice = tcs.select(estimated)
    assert (choice.basis, choice.indices) == ("success", best)
    plain = choice.to_json("isotropy")
    assert plain["rooms_done"] == plain["success"]
    found = tcs.evaluate(estimated, samples=2, select="robust", jobs=1)
    assert tuple(found.sets[0]) == best
    tcs.save(tmp_path / "robust.tcs", estimated)
    again = tcs.load(tmp_path / "robust.tcs").nominal.success
    assert np.array_equal(again.rooms_done, estimated.nominal.success.rooms_done)
