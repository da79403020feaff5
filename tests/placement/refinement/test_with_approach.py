"""Refinement and success under error of a file that was scored with approach."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tcs
from tcs.kernel.approach.sweep import approach_spline
from tcs.kernel.rows import grid_rows
from tcs.motion import check_approaches
from tcs.motion.approach_check import ApproachScene
from tcs.placement.refinement import PointScorer, score_members
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.tables import Reason, RefinedSet
from tests.beside import BESIDE
from tests.exact import exact_task

APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)
SAMPLES = 12


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beside")
    environment = folder / "beside.yaml"
    environment.write_text(BESIDE)
    return tcs.score(exact_task("shaving", folder), environment)


@pytest.fixture(scope="module")
def refined(scored):
    return tcs.refine(scored, starts=1, rounds=2, keep_success=False)


def points_of(file, flat):
    values = file.configurations.values(np.asarray(flat))
    return np.stack([*values.values()], axis=1)


def test_scores_at_grid_points_are_those_of_the_grid(scored):
    scores, size = scored.nominal.scores, scored.configurations.size
    assert np.isin(scores.reason, APPROACH).any()
    found = PointScorer.of(scored, 0).score_table(points_of(scored, range(size)), scores.weights)
    for name in ("reason", "dexterity", "arm_joints"):
        np.testing.assert_array_equal(getattr(found, name), getattr(scores, name))
    blocked = scores.reason == Reason.APPROACH_BLOCKED
    names = [
        [table.pair_names[i] for i in table.pair[blocked].tolist()] for table in (found, scores)
    ]
    assert names[0] == names[1]


def test_refined_sets_reach_what_they_can_approach(refined):
    table, scene = refined.nominal.refined, ApproachScene.of(*rebuild_scenes(refined)[0])
    assert table.reached.any()
    for row, member in np.argwhere(table.reached.any(axis=2)):
        there = scene.at(table.values[row, member], {})
        single = grid_rows(there.lowered.grid)
        for g in np.flatnonzero(table.reached[row, member]).tolist():
            q = table.arm_joints[row, member, g].astype(float)
            assert (
                approach_spline(there.problem, there.lines, single, g, q, there.around) is not None
            )
    found = check_approaches(refined, pairs=1)
    assert (found.checked, found.refined_checked, found.false) == (2, 1, 0)


def test_a_refined_posture_without_approach_is_found(refined):
    # From a base 3 cm away, the stored joints hold the tool elsewhere.
    table = refined.nominal.refined
    moved = dataclasses.replace(table, values=table.values + np.array([0.03, 0.0, 0.0, 0.0]))
    nominal = dataclasses.replace(refined.nominal, refined=moved)
    found = check_approaches(dataclasses.replace(refined, tables=(nominal,)), pairs=1)
    assert found.false == found.refined_checked == 1


def test_members_of_refined_sets_have_reasons_of_approaches(refined):
    table = refined.nominal.refined
    row = int(np.argmax(table.sizes))
    order = tuple(range(int(table.sizes[row])))
    scores = score_members(refined, RefinedSet(refined.nominal_index, row, order)).scores
    np.testing.assert_array_equal(scores.reached, table.reached[row, list(order)])
    assert not scores.reached.all()


def test_without_error_a_set_reaches_what_the_file_says(scored):
    trials = Trials.of(scored, body_collisions="all")
    members = scored.nominal.sets.candidates
    offsets = {name: np.zeros(2) for name in trials.errors.errors}
    found = trials.reached(members, offsets)
    for sample in range(2):
        np.testing.assert_array_equal(found[:, sample], scored.nominal.scores.reached[members])
    points = PerturbedPoints(trials, offsets, jobs=2).reached(points_of(scored, members))
    np.testing.assert_array_equal(points, found)


def test_under_error_a_goal_has_to_be_approachable_where_it_is_then(scored):
    trials = Trials.of(scored, body_collisions="all")
    members = scored.nominal.sets.candidates
    offsets = trials.errors.draw(SAMPLES, 0)
    found = trials.reached(members, offsets)
    reasons = PerturbedPoints(trials, offsets, jobs=2).reasons(points_of(scored, members))
    np.testing.assert_array_equal(reasons == Reason.REACHED, found)
    assert np.isin(reasons, APPROACH).any()
    # Live scoring builds the displaced scene by itself.
    live = tcs.LiveScorer(scored.metadata["task"], scored.metadata["environment"])
    for sample in (0, SAMPLES - 1):
        positions, _ = trials.positions(0, {n: v[[sample]] for n, v in offsets.items()})
        joints = {name: float(positions[name][0]) for name in offsets}
        again = live.score(joints).nominal.scores.reason[members]
        np.testing.assert_array_equal(reasons[:, sample], again)


def test_the_base_is_where_it_is_at_the_torso_height(scored, monkeypatch):
    """A lower base, seen from the arm, blocks few approaches: no other test here would show it."""
    trials = Trials.of(scored)
    trials.start.ensure()
    of_levels, placed = trials.hands[0].approaches.scene.moved, []
    assert np.ptp(of_levels, axis=0).any()

    def noted(problem, lines, rows, pairs, memory):
        placed.append(memory.moved[rows.torso])

    monkeypatch.setattr("tcs.kernel.approach.regions.score_approaches", noted)
    members = [int(h) for h in scored.nominal.sets.candidates[:6]]
    for member in members:
        trials.outcome(member, {name: np.zeros(1) for name in trials.errors.errors})
    levels = trials.poses(members).torso
    assert len({*levels.tolist()}) > 1
    for level, moved in zip(levels, placed, strict=True):
        np.testing.assert_array_equal(moved, of_levels[level : level + 1])


def test_evaluations_say_that_they_count_approachable_postures(scored, refined):
    assert tcs.evaluate(scored, samples=3).to_json()["approach"] is True
    assert tcs.evaluate(refined, select="refined", samples=3).to_json()["approach"] is True


def test_blocks_of_trials_with_approach_are_others(scored):
    without = dataclasses.replace(
        scored, metadata={k: v for k, v in scored.metadata.items() if k != "approach"}
    )
    assert Trials.of(scored).key != Trials.of(without).key
