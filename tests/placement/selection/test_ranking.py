"""What is recommended where nobody asks for another set: the rule in plain loops over all sets."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.words import choice_in_words, summary_in_words
from tcs.placement.constraints import Constraints
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import SelectionTables, UtilityWeights, select
from tcs.placement.store import StateTables
from tcs.placement.tables import Reason, ScoreTable
from tests.placement.selection.test_estimated import estimated
from tests.placement.store.example import score_file
from tests.placement.tables.small import all_sets, random_scores, small_grid

GRID = small_grid(nx=5, ny=3, torsos=1, bed=2)
HERE = InitialConfiguration(base_x=-1.0, base_y=0.2, base_yaw=0.0, torso=0.0)


def most_goals(kept):
    """Most goals, then fewest members, then the greatest P_M; the first among equals."""
    return max(kept, key=lambda one: (round(kept[one][0], 9), -len(one), kept[one][1]))


@pytest.mark.parametrize("most", [1, 2, 3])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.6])
def test_without_the_current_state_a_further_stop_has_to_gain_a_goal(share, most):
    scores = random_scores(GRID, 5, seed=4, share=share)
    tables = SelectionTables(build_sets(scores, GRID, max_members=3), GRID)
    kept = all_sets(scores, GRID, 0.4, max_members=3)
    choice = select(tables, max_members=most)
    assert choice.indices == most_goals({one: kept[one] for one in kept if len(one) <= most})
    assert choice.basis == "goals"
    if len(choice.members) > 1:
        fewer = {one: kept[one] for one in kept if len(one) < len(choice.members)}
        assert choice.fewer.indices == most_goals(fewer)
        assert choice.reachability > choice.fewer.reachability


@pytest.fixture(scope="module")
def close():
    """Two configurations that reach every goal; together they have a little more dexterity."""
    dexterity = np.zeros((GRID.size, 4), dtype=np.float32)
    dexterity[0], dexterity[-1] = 0.5, (0.51, 0.4, 0.4, 0.4)
    reached = dexterity > 0.0
    scores = ScoreTable(
        dexterity=dexterity,
        reason=np.where(reached, Reason.REACHED, Reason.TOO_FAR).astype(np.uint8),
        pair=np.full(dexterity.shape, -1, dtype=np.int16),
        pair_names=(),
        arm_joints=np.zeros((int(reached.sum()), 7), dtype=np.float32),
        weights=np.full(4, 0.25),
    )
    tables = (StateTables.of(scores, build_sets(scores, GRID)),)
    return dataclasses.replace(score_file(grid=GRID), tables=tables)


def test_a_third_decimal_of_dexterity_is_no_second_stop(close):
    assert len(close.nominal.sets.best) == 2
    assert tcs.select(close).indices == (0,)
    # What is shown, explained and summarised is what `select` recommends.
    assert ShownSet.of(close, None).indices == (0,)
    assert tcs.explain(close, 0).best_set == (0,)
    summary = summary_in_words(close, {"best": None, "best_single": None})
    assert summary["recommended"]["configurations"] == [0]
    # The utility of the paper still takes the pair, and the gain is stated.
    paper = tcs.select(close, weights=UtilityWeights(places=0.0))
    assert len(paper.members) == 2
    gain = choice_in_words(close, paper, None)["gain"]
    assert gain == "2 stops instead of 1: P_M 0.502 instead of 0.500"


@pytest.fixture(scope="module")
def robust():
    """A file whose most robust set is not the one with the best scores."""
    plain = score_file(grid=small_grid(nx=6, ny=5, yaws=4, bed=2), share=0.3)
    success = estimated(plain.nominal.sets, np.random.default_rng(1))
    return dataclasses.replace(plain, tables=(dataclasses.replace(plain.nominal, success=success),))


@pytest.mark.parametrize("here", [None, HERE], ids=["anywhere", "here"])
def test_with_estimates_the_most_robust_set_is_recommended(robust, here):
    success = robust.nominal.success
    choice = tcs.select(robust, here)
    assert success.low[success.row_of(choice.indices)] == success.low.max()
    assert choice.basis == "success"
    assert set(choice.indices) != set(robust.nominal.sets.best)
    assert set(ShownSet.of(robust, here).indices) == set(choice.indices)
    # With weights, the utility decides.
    assert tcs.select(robust, HERE, weights=UtilityWeights()).indices != choice.indices


def test_constraints_that_leave_no_estimated_set_still_get_an_answer(robust):
    # One single is the only set with an estimate.
    success = robust.nominal.success
    fields = ("members", "success", "low", "high", "samples")
    one = type(success)(**{name: getattr(success, name)[:1] for name in fields})
    file = dataclasses.replace(robust, tables=(dataclasses.replace(robust.nominal, success=one),))
    estimated_at = file.configurations.configuration(int(one.members[0, 0]))
    elsewhere = Constraints(only=(f"base_x>{estimated_at.base_x:g}",))
    choice = tcs.select(file, constraints=elsewhere)
    assert choice.basis == "goals"
    assert min(member.base_x for member in choice.members) > estimated_at.base_x
    with pytest.raises(SelectionError, match="was estimated is reachable"):
        tcs.select(file, HERE, constraints=elsewhere, weights=UtilityWeights(success=1.0))


def test_what_needs_the_current_state_says_so(close):
    with pytest.raises(SelectionError, match="requires the current state"):
        tcs.select(close, constraints=Constraints(keep=("bed_height",)))
    choice = tcs.select(close, weights=UtilityWeights(travel=5.0, places=0.0))
    # Travel costs nothing; D is the way between the stops.
    assert choice.utility == choice.reachability + choice.manipulability
    assert choice.cost == pytest.approx(np.hypot(0.8, 0.4))
    assert choice.moves == ("bed_height",)
