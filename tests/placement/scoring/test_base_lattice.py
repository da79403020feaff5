import numpy as np
import pytest

from tcs.placement.scoring.sets import BORDER, lattice_of
from tcs.placement.tables import Reason, ScoreTable
from tests.placement.tables.small import small_grid


def scores_with(grid, blocked):
    """Scores of one goal, too far from everywhere; `blocked` are flat configurations."""
    reason = np.full((grid.size, 1), Reason.TOO_FAR, dtype=np.uint8)
    reason[blocked] = Reason.BODY_BLOCKED
    return ScoreTable(
        dexterity=np.zeros((grid.size, 1), dtype=np.float32),
        reason=reason,
        pair=np.full((grid.size, 1), -1, dtype=np.int32),
        pair_names=(),
        arm_joints=np.zeros((0, 7), dtype=np.float32),
        weights=np.ones(1),
    )


def plain_moves(scores, grid, lattice):
    """Return the same moves by plain loops over all positions, one state at a time."""
    free = {}
    for h in range(grid.size):
        *state, i, j, yaw, torso = grid.indices(h).tolist()
        free[*state, yaw, torso, i, j] = scores.reason[h, 0] != Reason.BODY_BLOCKED
    nx, ny = grid.axis("base_x").count, grid.axis("base_y").count
    border = [round((s - grid.axis(n).start) / -step) for s, step, n in
              zip(lattice.start, lattice.step, ("base_x", "base_y"), strict=True)]  # fmt: skip
    shape = (nx + 2 * border[0], ny + 2 * border[1])
    states = {key[:-2] for key in free}

    def is_free(state, i, j):
        if i in (0, shape[0] - 1) or j in (0, shape[1] - 1):
            return True
        inside = (min(max(i - border[0], 0), nx - 1), min(max(j - border[1], 0), ny - 1))
        return free[*state, *inside]

    moves = np.zeros((4, *shape), dtype=bool)
    for step, (dx, dy) in enumerate(((1, 0), (0, 1), (1, 1), (1, -1))):
        for i in range(shape[0] - dx):
            for j in range(max(0, -dy), shape[1] - max(0, dy)):
                places = {(i + p, j + q) for p in {0, dx} for q in {0, dy}}
                moves[step, i, j] = any(all(is_free(s, *p) for p in places) for s in states)
    return moves


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("bed", [0, 2])
def test_moves_agree_with_plain_loops(seed, bed):
    grid = small_grid(nx=5, ny=4, yaws=2, torsos=1, bed=bed)
    rng = np.random.default_rng(seed)
    scores = scores_with(grid, np.flatnonzero(rng.random(grid.size) < 0.75))
    lattice = lattice_of(scores, grid)
    # 0.6 m are three positions 0.2 m apart, and one more represents all beyond.
    assert lattice.start == pytest.approx((-0.7 - 0.8, 0.1 - 0.8), abs=1e-15)
    np.testing.assert_array_equal(lattice.moves, plain_moves(scores, grid, lattice))


def test_a_heading_has_to_be_free_at_both_ends_of_a_move():
    grid = small_grid(nx=2, ny=1, yaws=2, torsos=1)
    # The first position is free with the first heading only, the second with the second.
    lattice = lattice_of(scores_with(grid, [1, 2]), grid)
    inside = (round(BORDER / 0.2) + 1,) * 2
    assert not lattice.moves[0][inside]
    assert lattice_of(scores_with(grid, [1, 3]), grid).moves[0][inside]


def test_everything_free_allows_every_move():
    grid = small_grid(nx=1, ny=1, yaws=1, torsos=1)
    lattice = lattice_of(scores_with(grid, []), grid)
    # Neither axis has more than one value, so the step is 0.1 m.
    assert lattice.step == (0.1, 0.1)
    x, y = lattice.shape
    assert (x, y) == (15, 15)
    counts = lattice.moves.sum(axis=(1, 2)).tolist()
    assert counts == [(x - 1) * y, x * (y - 1), *[(x - 1) * (y - 1)] * 2]
