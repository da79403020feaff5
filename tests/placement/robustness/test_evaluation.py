"""Evaluations: without error the offline score, any member counts, reproducible by seed."""

from __future__ import annotations

import json

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError, TcsError, UnknownNameError
from tcs.model.scene import ErrorDistribution
from tcs.placement.robustness import Trials, evaluate, mean_of
from tcs.placement.tables import tc_reachability
from tcs.placement.tables.sets import Groups

NOTHING = {"person_x": ErrorDistribution(distribution="normal", std=0.0)}


def drawn_sets(file, rng, count):
    """Random pairs of candidates, kept or not: the property holds for any set."""
    candidates = file.nominal.sets.candidates
    return rng.choice(candidates, (count, 2)).tolist()


@pytest.mark.parametrize("which", ["chair", "bed"])
def test_without_error_the_score_is_the_offline_score(which, request, rng):
    file = request.getfixturevalue(f"{which}_file")
    trials = Trials.of(file, errors=NOTHING)
    for select in ("best", "single", *drawn_sets(file, rng, 5)):
        found = evaluate(trials, samples=3, select=select)
        assert np.all(found.fractions == found.reachability)
        members = tuple(map(int, found.sets[0]))
        assert (found.reachability, found.manipulability) == file.nominal.sets.scores_of(members)
    found = evaluate(trials, samples=30, select="uniform", members=1)
    assert found.fractions.tolist() == [
        file.nominal.sets.scores_of((int(h),))[0] for (h,) in found.sets
    ]


def test_each_drawn_set_is_evaluated_on_its_own_sample(bed_trials):
    found = evaluate(bed_trials, samples=12, select="uniform", members=2)
    assert found.sets.shape == (12, 2)
    for i, members in enumerate(found.sets):
        own = {name: values[i : i + 1] for name, values in found.offsets.items()}
        expected = bed_trials.reached(members, own)[:, 0].any(axis=0)
        np.testing.assert_array_equal(found.reached[i], expected)
    assert len(np.unique(found.reached, axis=0)) > 1


def test_a_goal_counts_when_any_member_reaches_it(bed_trials):
    both = evaluate(bed_trials, samples=40)
    alone = [evaluate(bed_trials, samples=40, select=[int(h)]) for h in both.sets[0]]
    assert len(alone) == 2
    either = alone[0].reached | alone[1].reached
    assert np.array_equal(both.reached, either)
    assert np.array_equal(both.fractions, tc_reachability(either, both.weights))
    # Each member adds goals, so the property is not tested on an idle second member.
    assert all(np.any(either & ~one.reached) for one in alone)


def test_growing_a_set_never_lowers_its_success(chair_trials, rng):
    first, second = drawn_sets(chair_trials.file, rng, 1)[0]
    one = evaluate(chair_trials, samples=50, select=[first])
    two = evaluate(chair_trials, samples=50, select=[first, second])
    assert np.all(two.fractions >= one.fractions)


def test_results_do_not_depend_on_the_number_of_jobs(bed_file):
    results = [
        evaluate(bed_file, samples=15, seed=4, jobs=jobs, select=select).to_json()
        for jobs in (1, 2)
        for select in ("best", "uniform")
    ]
    for result in results:
        assert result.pop("seconds") > 0
    assert results[:2] == results[2:]
    other = evaluate(bed_file, samples=4, seed=5)
    assert not np.array_equal(other.offsets["person_x"], evaluate(bed_file, samples=4).offsets)


def test_methods_share_the_samples(bed_trials):
    best = evaluate(bed_trials, samples=20)
    single = evaluate(bed_trials, samples=20, select="single")
    other = evaluate(bed_trials, samples=20, stream="by itself")
    for name, values in best.offsets.items():
        assert np.array_equal(values, single.offsets[name])
        assert not np.array_equal(values, other.offsets[name])


def test_larger_errors_reduce_the_mean(chair_file):
    def mean(sd):
        errors = {"person_x": ErrorDistribution(distribution="normal", std=sd)}
        return evaluate(chair_file, samples=200, errors=errors).summary.mean

    assert mean(0.0) > mean(0.05) > mean(0.3)


def test_figures_are_those_of_the_samples(bed_trials):
    found = evaluate(bed_trials, samples=60, seed=1)
    plain = found.to_json()
    assert json.loads(json.dumps(plain)) == plain
    assert {"mean", "std", "ci95", "per_goal", "samples", "seconds", "seed", "errors"} <= set(plain)
    assert plain["mean"] == pytest.approx(found.fractions.mean())
    assert plain["std"] == pytest.approx(found.fractions.std(ddof=1))
    assert tuple(plain["ci95"]) == mean_of(found.fractions).ci95
    assert plain["per_goal"] == pytest.approx(found.reached.mean(axis=0))
    assert np.dot(plain["per_goal"], found.weights) == pytest.approx(plain["mean"])
    assert plain["samples"] == 60
    assert plain["errors"]["person_x"] == {"distribution": "normal", "std": 0.05}
    assert plain["complete"] == pytest.approx(np.mean(found.fractions > 1 - 1e-9))
    assert [m["bed_height"] for m in plain["members"]]
    with pytest.raises(ValueError, match="read-only"):
        found.reached[0] = True


def test_other_tables_have_other_observed_states(bed_file):
    here = evaluate(bed_file, samples=20, table=0)
    there = evaluate(bed_file, samples=20, table=1)
    assert here.observed == {"person_y": 0.0}
    assert there.observed == {"person_y": 0.05}
    best = bed_file.tables[1].sets.best
    assert there.reachability == bed_file.tables[1].sets.scores_of(best)[0]


@pytest.mark.parametrize("members", [1, 2])
def test_equal_sets_have_the_greatest_reachability(bed_trials, members):
    found = evaluate(bed_trials, samples=40, select="equal", members=members)
    sets = bed_trials.scored.sets
    of_single = sets.single_reachability
    greatest = (
        of_single.max() if members == 1 else max(of_single.max(), sets.pairs.reachability.max())
    )
    for drawn in {tuple(row) for row in found.sets.tolist()}:
        assert sets.scores_of(drawn)[0] == pytest.approx(greatest, abs=1e-9)
    if members == 1:
        assert found.choices == np.count_nonzero(np.abs(of_single - greatest) < 1e-9)
    loose = evaluate(bed_trials, samples=40, select="uniform", members=members)
    assert 0 < found.choices <= loose.choices


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"samples": 0}, TcsError, "samples is 0; must be a whole number, 1"),
        ({"samples": 1.5}, TcsError, "samples is 1.5"),
        ({"jobs": 0}, TcsError, "jobs is 0; must be 1 or more"),
        ({"seed": -1}, TcsError, "seed is -1"),
        ({"select": "bset"}, UnknownNameError, "Did you mean 'best'"),
        ({"select": [3]}, TcsError, "must be a configuration that reaches a goal"),
        ({"select": []}, TcsError, "every member must"),
        ({"select": "uniform", "members": 3}, TcsError, "members is 3"),
        ({"table": 1}, TcsError, "already"),
    ],
    ids=str,
)
def test_invalid_options_are_refused(chair_trials, options, error, message):
    with pytest.raises(error, match=message) as caught:
        evaluate(chair_trials, **options)
    assert "\n" not in str(caught.value)


def test_a_table_without_candidates_is_refused(bed_trials):
    import dataclasses

    none = dataclasses.replace(bed_trials, table=0)
    empty = dataclasses.replace(
        none.scored.sets,
        candidates=np.empty(0, np.int32),
        reached=np.empty((0, 14), bool),
        dexterity=np.empty((0, 14), np.float32),
        cell=np.empty(0, np.int32),
        cell_xy=np.empty((0, 2)),
        pairs=Groups(
            cells=np.empty((0, 2), np.int32),
            count=np.empty(0, np.int64),
            **{f"{of}reachability": np.empty(0) for of in ("", "member_")},
            **{
                f"{of}{what}": np.empty(0, np.float32)
                for of in ("", "member_")
                for what in ("manipulability", "total")
            },
        ),
        best=(),
        best_single=(),
    )
    file = dataclasses.replace(
        none.file,
        tables=(tcs.placement.store.StateTables(empty, lambda: None), none.file.tables[1]),
    )
    with pytest.raises(SelectionError, match="no initial configuration reaches a goal"):
        evaluate(dataclasses.replace(none, file=file), samples=1)
