"""Refined sets: scores off the grid, laws of the search, storage, selection and re-check."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, StoreError, TcsError, UnknownNameError
from tcs.model.grid import Grid
from tcs.motion import plans
from tcs.motion.motion_plan import GoalResult
from tcs.motion.stop_tour import plan_stop
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.view import Controls, ViewedSet
from tcs.placement.refinement import (
    PointScorer,
    refinement_summary,
    score_members,
)
from tcs.placement.refinement.local_search import (
    Evaluated,
    LocalSearch,
    ScoreObjective,
    Space,
    Walk,
)
from tcs.placement.refinement.success_under_error import (
    ANGLE,
    RADIUS,
    SLACK,
    DisplacedBases,
    at_surest,
    settled,
)
from tcs.placement.robustness import PerturbedPoints, Trials, success_summary
from tcs.placement.store.encoding import decode, encode
from tcs.placement.tables import Estimates, Reason, RefinedSet, tc_reachability
from tests.beside import BESIDE

NAMES, ONE = ("success", "low", "high"), np.array([0.5])
ONCE = np.ones(1, np.int32)
HERE = tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.14, torso=0.15)


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    environment = tmp_path_factory.mktemp("beside") / "beside.yaml"
    environment.write_text(BESIDE)
    return tcs.score("shaving", environment, paper=True)


@pytest.fixture(scope="module")
def refined(scored):
    return tcs.refine(scored, starts=2, rounds=3, keep_success=False)


def test_scores_at_grid_points_are_those_of_the_grid(scored):
    grid = scored.configurations
    at = np.stack([*grid.values(np.arange(grid.size)).values()], axis=1)
    found = PointScorer.of(scored, 0).score(at)
    scores = scored.nominal.scores
    np.testing.assert_array_equal(found.reached, scores.reached)
    np.testing.assert_array_equal(found.dexterity, scores.dexterity)
    np.testing.assert_array_equal(found.joints[found.reached], scores.arm_joints)


def test_a_refined_set_is_not_worse(refined):
    found = refinement_summary(refined)
    totals = [
        found[key]["reachability"] + found[key]["manipulability"] for key in ("before", "after")
    ]
    assert totals[0] < totals[1]
    table = refined.nominal.refined
    assert np.all(np.diff(table.objective) <= 0.0)
    np.testing.assert_allclose(table.reachability + table.manipulability, table.objective)


def test_members_stay_between_the_ends_of_the_axes(refined):
    table, space = refined.nominal.refined, Space.of(refined.configurations, refined.nominal.sets)
    for k, size in enumerate(table.sizes):
        values = table.values[k, :size]
        assert np.all((values >= space.low) & (values <= space.high))
        assert space.allowed(values[None])[0]


def test_the_result_does_not_depend_on_the_number_of_threads(scored, refined):
    again = tcs.refine(scored, starts=2, rounds=3, keep_success=False, jobs=1).nominal.refined
    np.testing.assert_array_equal(again.values, refined.nominal.refined.values)


def test_drake_confirms_every_solution(refined):
    found = tcs.verify(refined, pairs=0, dense=0)
    assert found.refined_checked == np.count_nonzero(refined.nominal.refined.reached) > 0
    assert found.false_reached == 0
    assert found.is_sound


def test_drake_refutes_a_displaced_member(refined):
    table = refined.nominal.refined
    moved = dataclasses.replace(table, values=table.values + 0.01)
    nominal = dataclasses.replace(refined.nominal, refined=moved)
    found = tcs.verify(dataclasses.replace(refined, tables=(nominal,)), pairs=0, dense=0)
    assert found.false_reached == found.refined_checked


def test_a_file_keeps_refined_sets(refined):
    loaded = decode(encode(refined))
    for field in dataclasses.fields(refined.nominal.refined):
        np.testing.assert_array_equal(
            getattr(loaded.nominal.refined, field.name),
            getattr(refined.nominal.refined, field.name),
        )
    assert refinement_summary(loaded) == refinement_summary(refined)


def test_refined_sets_of_another_grid_are_refused(refined):
    table = refined.nominal.refined
    left_out = np.setdiff1d(np.arange(31), refined.nominal.sets.candidates)[0]
    other = dataclasses.replace(
        table, origin=np.where(table.origin < 0, -1, left_out).astype(np.int32)
    )
    with pytest.raises(StoreError, match="refined sets that do not belong"):
        dataclasses.replace(refined, tables=(dataclasses.replace(refined.nominal, refined=other),))


def test_selection_compares_refined_sets(refined):
    free = tcs.UtilityWeights(travel=0.0)
    choice = tcs.select(refined, HERE, weights=free)
    assert choice.refined == 0
    grid = tcs.select(refined, HERE, weights=free, refined=False)
    assert grid.refined is None
    assert choice.net_utility > grid.net_utility
    straight = tcs.select(refined, HERE, weights=tcs.UtilityWeights(travel=1e-6))
    stops = [choice.members[i] for i in straight.order]
    legs = [(HERE, stops[0]), *itertools.pairwise(stops)]
    driven = sum(np.hypot(a.base_x - b.base_x, a.base_y - b.base_y) for a, b in legs)
    assert straight.cost == pytest.approx(driven, rel=1e-12)


@pytest.fixture(scope="module")
def estimated(refined):
    return tcs.robustify(refined, samples=40, sets=40)


def check_estimates(file):
    """Assert that each refined set has the success that it has in the samples of the estimates."""
    table, found = file.nominal.refined, file.nominal.refined.success
    trials = Trials.of(file)
    samples = PerturbedPoints(trials, trials.errors.draw(40, 0, stream="race"), 1)
    assert np.all(found.samples == 40)
    for row in range(len(table.origin)):
        values = table.values[row, : table.sizes[row]]
        reached = samples.reached(values).any(axis=0)
        # Sets of a file scored as the paper does are compared by the mean fraction, as there.
        fraction = tc_reachability(reached, trials.weights).mean()
        assert found.success[row] == pytest.approx(fraction, rel=1e-12)
        assert found.rooms_done[row] == reached.all(axis=1).mean()


def test_refined_sets_get_the_success_of_the_same_samples(estimated):
    check_estimates(estimated)
    found = estimated.nominal.refined.success
    assert np.ptp(found.success) > 0.0
    assert np.all((found.low <= found.success) & (found.success <= found.high))
    surest = success_summary(estimated)["tables"][0]["refined"]
    assert surest["ci95"][0] == found.low.max()
    assert surest["success"] == found.success[surest["row"]]


def test_refinement_after_the_estimates_adds_those_of_its_sets(estimated):
    check_estimates(tcs.refine(estimated, starts=1, rounds=2, keep_success=False))


def test_estimates_of_refined_sets_are_stored(estimated):
    loaded = decode(encode(estimated)).nominal.refined.success
    assert np.all(loaded.samples == 40)
    for name in NAMES:
        of_file = getattr(estimated.nominal.refined.success, name)
        np.testing.assert_array_equal(getattr(loaded, name), of_file)
    with pytest.raises(TcsError, match="one success for each set"):
        dataclasses.replace(
            estimated.nominal.refined,
            success=Estimates(**dict.fromkeys(NAMES, ONE), samples=ONCE),
        )
    with pytest.raises(TcsError, match="low <= success"):
        Estimates(success=ONE, low=ONE + 0.1, high=ONE, samples=ONCE)


def test_selection_by_success_compares_refined_sets(refined, estimated):
    by_success = tcs.UtilityWeights(travel=0.0, success=3.0)
    choice = tcs.select(estimated, HERE, weights=by_success)
    grid = tcs.select(estimated, HERE, weights=by_success, refined=False)
    table = estimated.nominal.refined
    utilities = [
        tcs.UtilityWeights(travel=0.0).of_size(int(size)).reachability * reach
        + tcs.UtilityWeights(travel=0.0).of_size(int(size)).manipulability * dexterity
        + 3.0 * low
        for size, reach, dexterity, low in zip(
            table.sizes, table.reachability, table.manipulability, table.success.low, strict=True
        )
    ]
    if max(utilities) > grid.net_utility:
        assert choice.refined == int(np.argmax(utilities))
        assert choice.success == table.success.success[choice.refined]
        assert choice.success_ci95[0] == table.success.low[choice.refined]
        assert choice.net_utility == pytest.approx(max(utilities))
    else:
        assert choice.refined is None
    assert choice.warnings == ()
    # Without its estimate, a refined set cannot be compared.
    without = dataclasses.replace(estimated.nominal, refined=refined.nominal.refined)
    chosen = tcs.select(dataclasses.replace(estimated, tables=(without,)), HERE, weights=by_success)
    assert chosen.refined is None
    assert "Refined sets are not compared: success under error" in chosen.warnings[-1]


def test_a_sure_refined_set_is_selected(estimated):
    table = estimated.nominal.refined
    certain = np.ones(len(table.origin))
    sure = Estimates(success=certain, low=certain, high=certain, samples=certain.astype(np.int32))
    scored = dataclasses.replace(
        estimated.nominal, refined=dataclasses.replace(table, success=sure)
    )
    file = dataclasses.replace(estimated, tables=(scored,))
    weights = tcs.UtilityWeights(travel=0.0, success=100.0)
    choice = tcs.select(file, HERE, weights=weights)
    assert choice.refined is not None
    assert choice.to_json(measure="isotropy")["success_ci95"] == [1.0, 1.0]
    shown = ShownSet.of(file, HERE)
    assert (shown.refined is None) == (tcs.select(file, HERE).refined is None)
    best = ShownSet.of(file, None)
    assert best.success == (1.0, 1.0, 1.0, 1, False)
    assert ShownSet.of(file, None, refined=False).success.samples == 40


def test_constraints_hold_for_refined_sets(refined):
    least = refined.nominal.refined.values[0, :, 0].min()
    beyond = tcs.Constraints(only=(f"base_x > {least + 1e-6} m",))
    free = tcs.UtilityWeights(travel=0.0)
    chosen = tcs.select(refined, HERE, weights=free, constraints=beyond)
    assert all(member.base_x > least for member in chosen.members)
    box = tcs.Obstacle(x=5.0, y=5.0, width=0.1, depth=0.1, yaw=0.0, z_low=0.0, z_high=1.0)
    chosen = tcs.select(refined, HERE, constraints=tcs.Constraints(blocked=(box,)))
    assert chosen.refined is None
    assert "Refined sets are not compared: obstacles" in chosen.warnings[-1]


def test_a_set_keeps_the_success_of_the_grid(scored, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 100)
    options = {"starts": 1, "rounds": 4, "samples": 32}
    kept = tcs.refine(scored, **options)
    free = tcs.refine(scored, **options, keep_success=False)
    found = refinement_summary(kept)
    assert found["keep_success"]
    assert found["success"]["after"] >= found["success"]["before"] - SLACK
    assert kept.nominal.refined.objective[0] <= free.nominal.refined.objective[0]


def test_walks_move_to_sets_that_satisfy_the_condition(scored, rng):
    scorer, sets = PointScorer.of(scored, 0), scored.nominal.sets
    tried = []

    def keeps(offered):
        tried.extend(points for points in offered)
        return np.array([np.all(points[:, 1] < -0.95) for points in offered])

    search = LocalSearch(
        scorer, Space.of(scored.configurations, sets), ScoreObjective(sets.weights), rng
    )
    (free,), _ = search.run([sets.best_single], 3, lambda done, total: None)
    nowhere = dataclasses.replace(search, keeps=keeps)
    (still,), _ = nowhere.run([sets.best_single], 3, lambda done, total: None)
    assert free.passed
    assert not still.passed
    assert tried


def stand(x):
    rows = np.zeros((1, 2))
    return Evaluated(np.array([[x]]), *[rows] * 6)


def test_walks_move_back_to_the_surest_place():
    class Peaks:
        samples = 1

        def reached(self, points):
            # Two goals between 0.5 and 2.5, one elsewhere up to 3.5, none beyond.
            x = points[:, 0]
            return np.stack([x < 3.5, (x > 0.5) & (x < 2.5)], axis=-1)[:, None]

    walks = [Walk((0,), stand(3.0), 9.0), Walk((1,), stand(0.0), 0.0), Walk((2,), stand(5.0), 5.0)]
    for x in (1.0, 2.0, 3.0, 4.0):
        walks[1].move(stand(x), x)
    found = at_surest(walks, Peaks(), np.array([0.5, 0.5]))
    # Of equally sure places the last.
    assert [(walk.origin, walk.value) for walk in found] == [((1,), 2.0), ((0,), 9.0), ((2,), 5.0)]
    assert len(found[0].passed) == 2


def test_walks_move_back_until_they_keep_the_floor():
    class Floor:
        def keeps(self, sets):
            return np.array([points[0, 0] <= self.most for points in sets])

    screen, judge = Floor(), Floor()
    screen.most, judge.most = 2.5, 1.5
    walks = [Walk((0,), stand(0.0), 0.0), Walk((1,), stand(9.0), 9.0), Walk((2,), stand(1.0), 1.2)]
    for x in (1.0, 2.0, 3.0):
        walks[0].move(stand(x), x)
    kept = settled(walks, screen, judge)
    # The second never keeps the floor; the first moves back past the third.
    assert [(walk.origin, walk.value) for walk in kept] == [((2,), 1.2), ((0,), 1.0)]


@pytest.mark.parametrize("samples", ["errors", "displaced bases"])
def test_the_hardest_samples_have_the_largest_changes(scored, rng, samples):
    if samples == "errors":
        trials = Trials.of(scored)
        drawn = PerturbedPoints(trials, trials.errors.draw(50, 0), 1)
        size = sum((v / v.std()) ** 2 for v in drawn.offsets.values())
        kept = drawn.hardest(5).offsets
        name = next(iter(kept))
        rows = np.flatnonzero(np.isin(drawn.offsets[name], kept[name]))
    else:
        drawn = DisplacedBases.drawn(None, 50, rng)
        size = (drawn.offsets[:, :2] ** 2).sum(axis=1) / RADIUS**2
        size += (drawn.offsets[:, 2] / ANGLE) ** 2
        rows = np.flatnonzero(np.isin(drawn.offsets[:, 0], drawn.hardest(5).offsets[:, 0]))
    assert set(rows) == set(np.argsort(-size)[:5])


def test_perturbed_points_on_the_grid_are_those_of_trials(scored):
    trials = Trials.of(scored)
    offsets = trials.errors.draw(12, 3)
    members = np.array(scored.nominal.sets.best)
    at = np.stack([*scored.configurations.values(members).values()], axis=1)
    points = at
    found = PerturbedPoints(trials, offsets, 2).reached(points)
    np.testing.assert_array_equal(found, trials.reached(members, offsets))
    assert found.any()


def test_reasons_without_errors_are_those_of_the_grid(scored):
    trials = Trials.of(scored, body_collisions="all")
    still = {name: np.zeros(2) for name in trials.errors.draw(1, 0)}
    members = np.arange(0, scored.configurations.size, 3)
    at = np.stack([*scored.configurations.values(members).values()], axis=1)
    points = at
    found = PerturbedPoints(trials, still, 2).reasons(points)
    expected = scored.nominal.scores.reason[members]
    np.testing.assert_array_equal(found, np.stack([expected, expected], axis=1))
    assert len(np.unique(found)) > 2


def test_kept_environments_change_no_answer(scored):
    trials = Trials.of(scored)
    offsets = trials.errors.draw(12, 3)
    low, high = (
        np.stack([*scored.configurations.values(np.array([h])).values()], axis=1)
        for h in (scored.nominal.sets.candidates[0], scored.nominal.sets.candidates[-1])
    )
    low[0, -1], high[0, -1] = 0.15, 0.30
    kept = PerturbedPoints(trials, offsets, 1)
    for values in (low, high, low):
        points = values
        fresh = PerturbedPoints(trials, offsets, 1).reached(points)
        np.testing.assert_array_equal(kept.reached(points), fresh)
    assert len(kept.environments) == 1
    assert np.any(kept.reached(low) != kept.reached(high))


@pytest.mark.parametrize("body_collisions", ["paper", "none"])
def test_success_counts_the_collisions_that_were_asked_for(scored, monkeypatch, body_collisions):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 200)
    options = {"objective": "success", "starts": 1, "rounds": 1, "samples": 2}
    refined = tcs.refine(scored, **options, body_collisions=body_collisions)
    found = refinement_summary(refined)
    assert found["body_collisions"] == body_collisions
    members = np.array(scored.nominal.sets.best)
    before = {}
    for rule in ("paper", "none"):
        trials = Trials.of(scored, body_collisions=rule)
        offsets = trials.errors.draw(200, 0, stream="refinement check")
        reached = np.logical_or.reduce(trials.reached(members, offsets))
        before[rule] = float((reached @ trials.weights).mean())
    assert found["success"]["before"] == pytest.approx(before[body_collisions], abs=1e-12)
    assert before["none"] > before["paper"]


def test_success_is_judged_on_other_samples(scored, monkeypatch):
    monkeypatch.setattr("tcs.placement.refinement.refined_file.FRESH_SAMPLES", 200)
    found = tcs.refine(scored, objective="success", starts=1, rounds=1, samples=2)
    found = refinement_summary(found)
    assert found["success"]["samples"] == 200
    assert 0.0 < found["success"]["before"] < 1.0
    assert 0.0 < found["success"]["after"] < 1.0


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"objective": "speed"}, UnknownNameError, "unknown objective 'speed'"),
        ({"body_collisions": "some"}, UnknownNameError, "unknown body collisions 'some'"),
        ({"starts": 0}, TcsError, "starts is 0"),
        ({"rounds": 0}, TcsError, "rounds is 0"),
        ({"samples": 0}, TcsError, "samples is 0"),
        ({"table": 3}, SelectionError, "no table 3"),
    ],
    ids=str,
)
def test_invalid_requests_are_refused(scored, options, error, message):
    with pytest.raises(error, match=message):
        tcs.refine(scored, **options)


def test_headings_are_periodic_where_the_grid_covers_them(wheelchair, scored):
    grid = Grid.from_spec(wheelchair.grid)
    space = Space.of(grid, scored.nominal.sets)
    moved = space.inside(np.array([[9.0, -9.0, -0.1, 0.2]]))
    np.testing.assert_allclose(moved, [[1.5, -1.5, 2.0 * np.pi - 0.1, 0.2]])


def test_members_have_the_reasons_where_they_reach_nothing(refined):
    table = refined.nominal.refined
    row = int(np.argmax(table.sizes))
    order = tuple(reversed(range(int(table.sizes[row]))))
    found = score_members(refined, RefinedSet(0, row, order))
    np.testing.assert_array_equal(found.scores.reached, table.reached[row, list(order)])
    np.testing.assert_array_equal(found.scores.dexterity, table.dexterity[row, list(order)])
    blocked = found.scores.reason == Reason.ARM_BLOCKED
    assert np.any(found.scores.reason != Reason.REACHED)
    assert np.all(found.scores.pair[blocked] >= 0)
    assert found.members == tuple(table.members(refined.configurations, row)[i] for i in order)


def test_a_refined_set_is_evaluated_like_one_of_the_grid(scored, refined):
    table, best = refined.nominal.refined, scored.nominal.sets.best
    row = next(k for k, size in enumerate(table.sizes) if size == len(best))
    values = table.values.copy()
    grid = scored.configurations.values(np.array(best))
    values[row, : len(best)] = np.stack([*grid.values()], axis=1)
    on_grid = dataclasses.replace(table, values=values)
    file = dataclasses.replace(
        refined, tables=(dataclasses.replace(refined.nominal, refined=on_grid),)
    )
    found = tcs.evaluate(file, select="refined", row=row, samples=20)
    np.testing.assert_array_equal(found.reached, tcs.evaluate(scored, samples=20).reached)
    moved = tcs.evaluate(refined, select="refined", row=row, samples=20)
    assert moved.members != found.members
    with pytest.raises(SelectionError, match="no refined set 99"):
        tcs.evaluate(refined, select="refined", row=99)
    with pytest.raises(SelectionError, match="No sets of this table were refined"):
        tcs.evaluate(scored, select="refined")


def of_two_goals(stop, index, number, goals, *how):
    """Plan two goals of a stop, and hand the others back."""
    planned, found = plan_stop(stop, index, number, goals[:2], *how)
    left = tuple(GoalResult(goal, None, False, "not asked for") for goal in goals[2:])
    return planned, (*found, *left)


@pytest.mark.parametrize("chosen", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_plans_stop_where_the_refined_set_is(refined, chosen, monkeypatch):
    if chosen:
        # The tours of all goals take half a minute: with the slow tests.
        monkeypatch.setattr(plans, "plan_stop", of_two_goals)
    free = tcs.UtilityWeights(travel=0.0)
    choice = tcs.select(refined, HERE, weights=free)
    table = refined.nominal.refined
    members = choice if chosen else RefinedSet(0, choice.refined, choice.order)
    found = tcs.plan(refined, members)
    for stop, i in zip(found.stops, choice.order, strict=True):
        at, expected = stop.at, choice.members[i]
        assert stop.index is None
        assert [at.base_x, at.base_y, at.base_yaw, at.torso] == pytest.approx(
            [expected.base_x, expected.base_y, expected.base_yaw, expected.torso]
        )
    assert found.false == 0
    reached = table.reached[choice.refined].any(axis=0)
    assert [result.reason == "unreached" for result in found.results] == list(~reached)


def test_a_refined_set_is_shown(scored, refined):
    table = refined.nominal.refined
    shown = ShownSet.of(refined, None)
    assert shown.members == table.members(refined.configurations, 0)
    assert (shown.reachability, shown.manipulability) == (
        table.reachability[0],
        table.manipulability[0],
    )
    assert shown.stored == ()
    assert ShownSet.of(refined, None, refined=False).members == ShownSet.of(scored, None).members
    assert len(ShownSet.of(refined, None, 1).members) == 1
    viewed = ViewedSet.of_shown(shown)
    assert [viewed.configuration(h) for h in viewed.members] == list(shown.members)
    controls = Controls(viewed)
    state = controls.first()
    result = viewed.result(controls.index(state))
    assert result.configuration == shown.members[0]
    assert result.reached == tuple(np.flatnonzero(table.reached[0, 0]))
    joints = viewed.joints(viewed.members[0], result.reached[0])
    np.testing.assert_array_equal(joints, table.arm_joints[0, 0, result.reached[0]])
    # A slider leads to the grid.
    slider = controls.sliders[-1]
    moved = controls.moved(state, slider.name, slider.low)
    assert controls.index(moved) < viewed.grid.size


def test_an_explanation_says_which_refined_members_reach_a_goal(scored, refined):
    table = refined.nominal.refined
    found = tcs.explain(refined, 0)
    assert found.refined == table.members(refined.configurations, 0)
    assert list(found.refined_reaching) == list(np.flatnonzero(table.reached[0, :, 0]))
    assert tcs.explain(scored, 0).to_json()["refined_set"] is None
