"""Selection among sets whose members no longer reach all they reach in the stored scores."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import assume, given, settings

from tcs.placement.constraints import Constraints
from tcs.placement.scoring.sets import build_sets
from tcs.placement.selection import SelectionTables, TravelWeights, UtilityWeights, best, select
from tcs.placement.selection.admission import Admitted
from tcs.placement.tables import ScoreTable
from tests.placement.selection.test_choice import HERE, brute_force
from tests.placement.tables.small import all_sets, random_scores, set_scores, small_grid

ANYTHING = Constraints(only=("base_x <= 9 m",))


def lowered(scores, seed, share):
    """Scores of which a part of the goals is not reached any more, or less dexterously."""
    rng = np.random.default_rng(seed)
    reached = scores.reached & (rng.random(scores.reached.shape) < share)
    fewer = rng.choice(np.float32([0.25, 1.0]), scores.reached.shape)
    dexterity = np.where(reached, scores.dexterity * fewer, np.float32(0.0))
    return ScoreTable(
        dexterity=dexterity,
        reason=np.where(reached, 0, np.maximum(scores.reason, 1)).astype(np.uint8),
        pair=np.full(reached.shape, -1, np.int32),
        pair_names=(),
        arm_joints=np.zeros((int(reached.sum()), 7), np.float32),
        weights=scores.weights,
    )


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 2**32 - 1),
    levels=st.sampled_from([0, 1, 2]),
    share=st.sampled_from([0.3, 0.9]),
    min_distance=st.sampled_from([0.0, 0.4]),
    weights=st.sampled_from([(1.0, 1.0, 0.05), (0.0, 1.0, 0.5), (10.0, 1.0, 0.0)]),
    turn=st.sampled_from([0.0, 0.3]),
    members=st.sampled_from([2, 3]),
)
def test_equals_a_loop_over_all_kept_sets(
    seed, levels, share, min_distance, weights, turn, members
):
    grid = small_grid(nx=5, ny=2, yaws=2, torsos=1)
    whole = random_scores(grid, 4, seed, levels=levels)
    less = lowered(whole, seed, share)
    kept = {
        one: set_scores(less, one)
        for one in all_sets(whole, grid, min_distance, max_members=members)
        if all(less.reached[h].any() for h in one)
    }
    assume(kept)
    sets = build_sets(whole, grid, min_distance=min_distance, max_members=members)
    rows = sets.candidates
    admitted = Admitted(
        less.reached[rows].any(axis=1), less.reached[rows], less.dexterity[rows], (), (), None,
        has_lower_scores=True,
    )  # fmt: skip
    alpha, beta, gamma = weights
    utility = UtilityWeights(
        reachability=alpha, manipulability=beta, travel=gamma, places=0.0, environment=0.0
    )
    travel = TravelWeights(turn=turn)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(best, "admitted_candidates", lambda *_: admitted)
        choice = select(
            SelectionTables(sets, grid), HERE, weights=utility, travel=travel, constraints=ANYTHING
        )
    indices, value, cost = brute_force(kept, grid, HERE, utility, travel)
    assert (choice.indices, choice.utility, choice.cost) == (indices, value, cost)
    assert (choice.reachability, choice.manipulability) == kept[indices]


def test_what_is_derived_from_a_table_is_kept():
    grid = small_grid()
    tables = SelectionTables(build_sets(random_scores(grid, 3, 0), grid), grid)
    assert tables.index is tables.index
    assert list(tables.derived) == ["index"]
