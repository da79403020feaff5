"""Selection with delta: the best of all sets with an estimate, by exhaustive search."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.robustness.kept_pairs import Pairs, kept_pairs
from tcs.placement.selection import TravelWeights, UtilityWeights, select
from tcs.placement.store import load_scores, save_scores
from tcs.placement.tables import SuccessTable
from tcs.placement.tables.success import NO_MEMBER
from tests.placement.store.example import score_file
from tests.placement.tables.small import small_grid

HERE = InitialConfiguration(base_x=0.3, base_y=-0.4, base_yaw=1.0, torso=0.1)


def estimated(sets, rng, singles=15, pairs=60):
    """Synthetic estimates for some of the sets, with few distinct values so that ties occur."""
    alone = np.sort(rng.choice(len(sets.candidates), singles, replace=False))
    kept = Pairs.joined(kept_pairs(sets))
    some = rng.choice(kept.first.size, pairs, replace=False)
    both = sorted(zip(kept.first[some].tolist(), kept.second[some].tolist(), strict=True))
    members = np.full((singles + pairs, 2), NO_MEMBER, dtype=np.int32)
    members[:singles, 0] = sets.candidates[alone]
    members[singles:] = sets.candidates[np.array(both)]
    success = rng.integers(0, 9, len(members)) / 8
    return SuccessTable(
        members=members,
        success=success,
        low=success * 0.9,
        high=np.minimum(1.0, success + 0.1),
        samples=np.full(len(members), 64, dtype=np.int32),
    )


@pytest.fixture(scope="module")
def file():
    plain = score_file(grid=small_grid(nx=6, ny=5, yaws=4, bed=2), share=0.3)
    table = plain.tables[0]
    success = estimated(table.sets, np.random.default_rng(1))
    return dataclasses.replace(plain, tables=(dataclasses.replace(table, success=success),))


def only(success, rows):
    fields = ("members", "success", "low", "high", "samples")
    return SuccessTable(**{name: getattr(success, name)[rows] for name in fields})


def with_success(file, success):
    return dataclasses.replace(file, tables=(dataclasses.replace(file.tables[0], success=success),))


def costs(file, here, travel):
    """D of each set with an estimate: its cost when it is the only one."""
    success, found = file.nominal.success, []
    for row in range(len(success.success)):
        alone = with_success(file, only(success, slice(row, row + 1)))
        choice = select(alone, here, weights=UtilityWeights(success=1.0), travel=travel)
        assert choice.indices == success.set_at(row)
        found.append(choice.cost)
    return found


def by_hand(file, cost, weights, max_members):
    """Utility and members of the set with the greatest utility, by a plain loop."""
    table, best = file.nominal, None
    for row, success in enumerate(table.success.low.tolist()):
        members = table.success.set_at(row)
        if len(members) > max_members:
            continue
        r, m = table.sets.scores_of(members)
        value = (weights.reachability * r + weights.manipulability * m) - weights.travel * cost[row]
        value += weights.success * success
        if best is None or value > best[0]:
            best = (value, members)
    return best


@pytest.mark.parametrize("moves", ["straight", "everything"])
def test_the_best_of_all_sets_with_an_estimate(file, moves):
    here, travel = HERE, TravelWeights()
    if moves == "everything":
        travel = TravelWeights(turn=0.3, torso=2.0, environment=(("bed_height", 0.5),))
        here = dataclasses.replace(
            HERE, environment=(("bed_height", 0.1),), environment_units=("m",)
        )
    cost = costs(file, here, travel)
    seen = set()
    for alpha, beta, gamma, delta, most in itertools.product(
        (0.0, 1.0), (0.0, 1.0), (0.0, 0.2, 3.0), (0.1, 1.0, 50.0), (1, 2)
    ):
        weights = UtilityWeights(
            reachability=alpha,
            manipulability=beta,
            travel=gamma,
            success=delta,
            places=0.0,
            environment=0.0,
        )
        choice = select(file, here, weights=weights, travel=travel, max_members=most)
        assert (choice.utility, choice.indices) == by_hand(file, cost, weights, most)
        row = file.nominal.success.row_of(choice.indices)
        assert choice.success == file.nominal.success.success[row]
        assert choice.success_ci95[0] <= choice.success <= choice.success_ci95[1]
        seen.add(choice.indices)
    assert len(seen) > 5


def test_without_delta_estimates_change_nothing(file):
    plain = with_success(file, None)
    for gamma in (0.0, 0.05, 1.0):
        weights = UtilityWeights(travel=gamma)
        one, other = select(plain, HERE, weights=weights), select(file, HERE, weights=weights)
        assert (one.indices, one.utility, one.cost) == (other.indices, other.utility, other.cost)
        assert one.success is None


def test_delta_needs_estimates():
    with pytest.raises(SelectionError, match="tcs robustify FILE"):
        select(score_file(), HERE, weights=UtilityWeights(success=1.0))


def test_delta_needs_an_estimate_of_a_set_as_small(file):
    success = file.nominal.success
    only_pairs = with_success(file, only(success, success.of_size(2)))
    with pytest.raises(SelectionError, match="with at most 1 members"):
        select(only_pairs, HERE, weights=UtilityWeights(success=1.0), max_members=1)


def test_three_members_are_not_chosen_by_estimates_of_two():
    plain = score_file(share=0.2, options={"max_members": 3})
    sets = plain.nominal.sets
    assert sets.triples.kept
    file = with_success(plain, estimated(sets, np.random.default_rng(1), 5, 20))
    weights = UtilityWeights(success=1.0)
    with pytest.raises(SelectionError, match=r"for any set of three\. Use max_members 2"):
        select(file, HERE, weights=weights, max_members=3)
    # Without max_members the best set with an estimate is selected.
    assert (
        select(file, HERE, weights=weights).indices
        == select(file, HERE, weights=weights, max_members=2).indices
    )


@pytest.mark.parametrize("delta", [-1.0, float("nan"), 1e10, True])
def test_impossible_weights_are_refused(delta):
    with pytest.raises(SelectionError, match="delta"):
        UtilityWeights(success=delta)


def test_estimates_survive_a_file(file, tmp_path):
    path = tmp_path / "file.tcs"
    save_scores(path, file)
    back = load_scores(path).nominal.success
    for name in ("members", "success", "low", "high", "samples"):
        assert np.array_equal(getattr(back, name), getattr(file.nominal.success, name))
    weights = UtilityWeights(success=2.0)
    one = select(file, HERE, weights=weights)
    other = select(load_scores(path), HERE, weights=weights)
    assert (one.indices, one.utility) == (other.indices, other.utility)
