import dataclasses
import itertools

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from tcs.errors import TcsError
from tcs.scoring.sets import build_sets
from tcs.tables import ScoreTable
from tests.tables.small import all_sets, random_scores, small_grid

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
)
def test_agrees_with_plain_loops_over_all_pairs(table, min_distance, bed):
    grid = small_grid(bed=bed)
    scores = random_scores(grid, **table)
    sets = build_sets(scores, grid, min_distance=min_distance)
    expected = all_sets(scores, grid, min_distance)

    assert sets.sets == len(expected)
    assert sets.candidates.tolist() == [members[0] for members in expected if len(members) == 1]
    for members, pair in expected.items():
        assert sets.scores_of(members) == pair

    kept = {}
    cell = dict(zip(sets.candidates.tolist(), sets.cell.tolist(), strict=True))
    for members, pair in expected.items():
        if len(members) == 2:
            kept.setdefault(tuple(sorted(cell[h] for h in members)), []).append(pair)
    assert [tuple(cells) for cells in sets.pair_cells.tolist()] == sorted(kept)
    for k, cells in enumerate(sorted(kept)):
        reachability, manipulability = np.array(kept[cells]).T
        assert sets.pair_count[k] == len(kept[cells])
        assert sets.pair_reachability[k] == reachability.max()
        for bound, exact in (
            (sets.pair_manipulability[k], manipulability.max()),
            (sets.pair_sum[k], (reachability + manipulability).max()),
        ):
            # Never below, and no more than one float32 step above.
            assert exact <= float(bound)
            assert float(np.nextafter(bound, np.float32(-1.0))) < exact

    by_sum = lambda members: sum(expected[members])  # noqa: E731  max() takes the first of equals
    assert sets.best == max(expected, key=by_sum, default=())
    assert sets.best_single == max(
        (members for members in expected if len(members) == 1), key=by_sum, default=()
    )


def test_result_does_not_depend_on_jobs():
    grid = small_grid(nx=12, ny=10)
    scores = random_scores(grid, 5, seed=7, levels=3)
    one, two = (build_sets(scores, grid, jobs=jobs) for jobs in (1, 2))
    assert one.kept_pairs > 0
    for field in dataclasses.fields(one):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(two, field.name))


def test_places_a_rounding_error_short_of_the_distance_are_paired():
    grid = small_grid(nx=20, ny=1, yaws=1, torsos=1, step=0.05)
    x = grid.values(np.arange(20))["base_x"]
    assert np.any(x[8:] - x[:-8] < 0.4)  # else this tests nothing
    reason = np.zeros((20, 2), dtype=np.uint8)
    reason[:10, 1] = reason[10:, 0] = 1
    reached = reason == 0
    scores = ScoreTable(
        isotropy=np.where(reached, np.float32(0.5), np.float32(0.0)),
        reason=reason,
        pair=np.full((20, 2), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((20, 7), dtype=np.float32),
        weights=np.array([0.5, 0.5]),
    )
    sets = build_sets(scores, grid)
    apart = [(a, b) for a, b in itertools.product(range(10), range(10, 20)) if b - a >= 8]
    assert [tuple(cells) for cells in sets.pair_cells.tolist()] == apart


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
        ({"grid": small_grid(nx=5)}, "has 48 configurations, the grid 60"),
    ],
)
def test_refuses(changes, message):
    grid = small_grid()
    with pytest.raises(TcsError, match=message):
        build_sets(random_scores(grid, 2, seed=0), **({"grid": grid} | changes))
