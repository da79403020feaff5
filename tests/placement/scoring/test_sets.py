import dataclasses
import itertools

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from tcs.errors import TcsError, UnknownNameError
from tcs.placement.scoring import triples
from tcs.placement.scoring.sets import build_sets
from tcs.placement.tables import ScoreTable
from tests.placement.tables.small import all_sets, order_of, random_scores, small_grid

small_tables = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 2**32 - 1),
        "goals": st.integers(1, 6),
        "levels": st.sampled_from([0, 1, 2, 4]),
        "share": st.sampled_from([0.05, 0.3, 0.7, 1.0]),
    }
)


@settings(deadline=None, max_examples=60)  # the first example compiles
@given(
    table=small_tables,
    min_distance=st.sampled_from([0.0, 0.2, 0.4, 0.5, 3.0]),
    bed=st.sampled_from([0, 2]),
    rule=st.sampled_from(["paper", "code2015"]),
    same_environment=st.booleans(),
)
def test_agrees_with_plain_loops_over_all_pairs(table, min_distance, bed, rule, same_environment):
    grid = small_grid(bed=bed)
    scores = random_scores(grid, **table)
    sets = build_sets(
        scores, grid, min_distance=min_distance, rule=rule, same_environment=same_environment
    )
    expected = all_sets(scores, grid, min_distance, rule, same_environment)

    assert sets.sets == len(expected)
    assert sets.candidates.tolist() == [members[0] for members in expected if len(members) == 1]
    for members, pair in expected.items():
        assert sets.scores_of(members) == pair

    kept = {}
    cell = dict(zip(sets.candidates.tolist(), sets.cell.tolist(), strict=True))
    for members, pair in expected.items():
        if len(members) == 2:
            kept.setdefault(tuple(sorted(cell[h] for h in members)), []).append(pair)
    assert [tuple(cells) for cells in sets.pairs.cells.tolist()] == sorted(kept)
    for k, cells in enumerate(sorted(kept)):
        reachability, manipulability = np.array(kept[cells]).T
        assert sets.pairs.count[k] == len(kept[cells])
        assert sets.pairs.reachability[k] == reachability.max()
        for bound, exact in (
            (sets.pairs.manipulability[k], manipulability.max()),
            (sets.pairs.total[k], (reachability + manipulability).max()),
        ):
            # Never below, and no more than one float32 step above.
            assert exact <= float(bound)
            assert float(np.nextafter(bound, np.float32(-1.0))) < exact

    for c, h in enumerate(sets.candidates.tolist()):
        of_h = [pair for members, pair in expected.items() if len(members) == 2 and h in members]
        reachability, manipulability = np.array(of_h).reshape(-1, 2).T
        assert sets.pairs.member_reachability[c] == reachability.max(initial=0.0)
        for bound, exact in (
            (sets.pairs.member_manipulability[c], manipulability.max(initial=0.0)),
            (sets.pairs.member_total[c], (reachability + manipulability).max(initial=0.0)),
        ):
            assert exact <= float(bound) <= float(np.nextafter(np.float32(exact), np.float32(9.0)))

    def key(members):
        return order_of(rule, expected[members])

    # max() takes the first of equals.
    assert sets.best == max(expected, key=key, default=())
    singles = (members for members in expected if len(members) == 1)
    assert sets.best_single == max(singles, key=key, default=())


@settings(deadline=None, max_examples=60)  # the first example compiles
@given(
    table=small_tables,
    min_distance=st.sampled_from([0.0, 0.2, 0.4, 3.0]),
    bed=st.sampled_from([0, 2]),
    same_environment=st.booleans(),
    buffer=st.sampled_from([1, 50, triples.BUFFER]),
)
def test_triples_agree_with_plain_loops(table, min_distance, bed, same_environment, buffer):
    grid = small_grid(nx=4, ny=2, yaws=2 if not bed else 1, bed=bed)
    scores = random_scores(grid, **table)
    with pytest.MonkeyPatch.context() as patch:
        # Small tables fill no buffer, unless it is small too.
        patch.setattr(triples, "BUFFER", buffer)
        sets = build_sets(
            scores,
            grid,
            max_members=3,
            min_distance=min_distance,
            same_environment=same_environment,
        )
    expected = all_sets(
        scores, grid, min_distance, same_environment=same_environment, max_members=3
    )
    assert sets.sets == len(expected)
    assert sets.best == max(expected, key=lambda members: sum(expected[members]), default=())
    cell = dict(zip(sets.candidates.tolist(), sets.cell.tolist(), strict=True))
    kept, of_member = {}, {}
    for members, pair in expected.items():
        if len(members) == 3:
            kept.setdefault(tuple(sorted(cell[h] for h in members)), []).append(pair)
            for h in members:
                of_member.setdefault(h, []).append(pair)
    found = sets.triples
    assert [tuple(cells) for cells in found.cells.tolist()] == sorted(kept)
    assert found.count.tolist() == [len(kept[cells]) for cells in sorted(kept)]
    of_groups = [kept[cells] for cells in sorted(kept)]
    of_members = [of_member.get(h, []) for h in sets.candidates.tolist()]
    for prefix, groups in (("", of_groups), ("member_", of_members)):
        for g, pairs in enumerate(groups):
            reachability, manipulability = np.array(pairs).reshape(-1, 2).T
            assert getattr(found, f"{prefix}reachability")[g] == reachability.max(initial=0.0)
            for name, values in (
                ("manipulability", manipulability),
                ("total", reachability + manipulability),
            ):
                bound = getattr(found, prefix + name)[g]
                exact = values.max(initial=0.0)
                # Never below, and no more than one float32 step above.
                assert exact <= float(bound)
                assert float(bound) <= float(np.nextafter(np.float32(exact), np.float32(9.0)))


def test_the_code_of_2015_has_no_triples():
    grid = small_grid()
    with pytest.raises(TcsError, match="'code2015' keeps sets of one and two"):
        build_sets(random_scores(grid, 2, seed=0), grid, rule="code2015", max_members=3)


def test_too_many_candidates_for_triples(monkeypatch):
    monkeypatch.setattr(triples, "MOST_CANDIDATES", 5)
    grid = small_grid()
    with pytest.raises(TcsError, match="but at most 5 are allowed"):
        build_sets(random_scores(grid, 2, seed=0), grid, max_members=3)


def test_too_many_triples_of_base_cells(monkeypatch):
    grid = small_grid(nx=6)
    scores = random_scores(grid, 5, seed=0)
    monkeypatch.setattr(triples, "MOST_GROUPS", 3)
    with pytest.raises(TcsError, match="more than 3 triples of base cells"):
        build_sets(scores, grid, max_members=3)


def test_result_does_not_depend_on_jobs():
    grid = small_grid(nx=12, ny=10)
    scores = random_scores(grid, 7, seed=7, levels=20, share=0.3)
    one, two = (build_sets(scores, grid, jobs=jobs, max_members=3) for jobs in (1, 2))
    assert one.kept_pairs > 0
    assert one.triples.kept > 0
    for field in dataclasses.fields(one):
        if field.name not in ("lattice", "pairs", "triples"):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(two, field.name))
    for groups, field in itertools.product(("pairs", "triples"), dataclasses.fields(one.triples)):
        of_one, of_two = (getattr(getattr(of, groups), field.name) for of in (one, two))
        np.testing.assert_array_equal(of_one, of_two)
    np.testing.assert_array_equal(one.lattice.moves, two.lattice.moves)


def test_singles_only():
    grid = small_grid()
    sets = build_sets(random_scores(grid, 4, seed=3), grid, max_members=1)
    assert (sets.max_members, sets.kept_pairs, sets.best) == (1, 0, sets.best_single)
    assert len(sets.candidates) > 0


def test_two_fifths_of_the_goals_are_kept_by_the_code_of_2015():
    grid = small_grid(nx=1, ny=1, yaws=1, torsos=2)
    reason = np.array([[0, 0, 1, 1, 1], [0, 1, 1, 1, 1]], dtype=np.uint8)
    scores = ScoreTable(
        dexterity=np.where(reason == 0, np.float32(0.5), np.float32(0.0)),
        reason=reason,
        pair=np.full((2, 5), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((3, 7), dtype=np.float32),
        # One fifth, and two doubles less: together the double below 0.4.
        weights=np.array([0.2, 0.2 - 2.0**-54, 0.2, 0.2, 0.2]),
    )
    assert scores.reachability()[0] < 0.4
    assert build_sets(scores, grid, rule="code2015").candidates.tolist() == [0]


def test_the_code_of_2015_puts_reachability_first():
    """The set with the greatest sum is not its best: fewer goals, better reached."""
    grid = small_grid(nx=1, ny=1, yaws=1, torsos=2)
    dexterity = np.array([[0.1, 0.1, 0.1], [0.9, 0.9, 0.0]], dtype=np.float32)
    scores = ScoreTable(
        dexterity=dexterity,
        reason=np.where(dexterity > 0, 0, 1).astype(np.uint8),
        pair=np.full((2, 3), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((5, 7), dtype=np.float32),
        weights=np.full(3, 1 / 3),
    )
    assert build_sets(scores, grid).best == (1,)
    assert build_sets(scores, grid, rule="code2015").best == (0,)


def test_places_a_rounding_error_short_of_the_distance_are_paired():
    grid = small_grid(nx=20, ny=1, yaws=1, torsos=1, step=0.05)
    x = grid.values(np.arange(20))["base_x"]
    assert np.any(x[8:] - x[:-8] < 0.4)  # else this tests nothing
    reason = np.zeros((20, 2), dtype=np.uint8)
    reason[:10, 1] = reason[10:, 0] = 1
    reached = reason == 0
    scores = ScoreTable(
        dexterity=np.where(reached, np.float32(0.5), np.float32(0.0)),
        reason=reason,
        pair=np.full((20, 2), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((20, 7), dtype=np.float32),
        weights=np.array([0.5, 0.5]),
    )
    sets = build_sets(scores, grid)
    apart = [(a, b) for a, b in itertools.product(range(10), range(10, 20)) if b - a >= 8]
    assert [tuple(cells) for cells in sets.pairs.cells.tolist()] == apart


def test_nothing_reached_gives_no_sets():
    grid = small_grid()
    sets = build_sets(random_scores(grid, 3, seed=0, share=0.0), grid)
    assert (sets.sets, sets.best, sets.best_single) == (0, (), ())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"min_distance": -0.1}, "min_distance is -0.1"),
        ({"min_distance": float("inf")}, "min_distance is inf"),
        ({"min_distance": float("nan")}, "min_distance is nan"),
        ({"jobs": 0}, "0 jobs"),
        ({"max_members": 0}, "max_members is 0"),
        ({"max_members": 4}, "max_members is 4"),
        ({"grid": small_grid(nx=5)}, "has 48 configurations, the grid 60"),
    ],
)
def test_refuses(changes, message):
    grid = small_grid()
    with pytest.raises(TcsError, match=message):
        build_sets(random_scores(grid, 2, seed=0), **({"grid": grid} | changes))


def test_an_unknown_rule_is_named():
    grid = small_grid()
    with pytest.raises(UnknownNameError, match=r"unknown rule 'papr'.*Did you mean 'paper'"):
        build_sets(random_scores(grid, 2, seed=0), grid, rule="papr")
