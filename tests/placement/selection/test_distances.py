import heapq
import itertools
import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from tcs.errors import SelectionError
from tcs.placement.selection.distances import LatticeDistances
from tcs.placement.tables import BaseLattice
from tcs.placement.tables.sets import MOVES

STEP = (0.1, 0.2)


def lattice_of(free, step=STEP):
    """The lattice with free and blocked lattice positions."""
    moves = np.zeros((4, *free.shape), dtype=bool)
    for move, i, j in np.ndindex(moves.shape):
        dx, dy = MOVES[move]
        corners = [(i + p, j + q) for p in {0, dx} for q in {0, dy}]
        if all(0 <= p < free.shape[0] and 0 <= q < free.shape[1] for p, q in corners):
            moves[move, i, j] = all(free[corner] for corner in corners)
    return BaseLattice(start=(-1.0, 2.0), step=step, moves=moves)


def position(lattice, i, j):
    return lattice.start[0] + i * lattice.step[0], lattice.start[1] + j * lattice.step[1]


def distances_over(lattice):
    """Return distances whose cells are all positions of a lattice, row by row."""
    xy = np.array([position(lattice, i, j) for i, j in np.ndindex(lattice.shape)])
    return LatticeDistances(xy, lattice)


def shortest(lattice, entries):
    """Distances from some entries, {(i, j): metres}: Dijkstra's algorithm in plain loops."""
    done, queue = {}, [(metres, at) for at, metres in entries.items()]
    heapq.heapify(queue)
    while queue:
        metres, (i, j) = heapq.heappop(queue)
        if (i, j) in done:
            continue
        done[i, j] = metres
        for move, (dx, dy) in enumerate(MOVES):
            length = math.hypot(dx * lattice.step[0], dy * lattice.step[1])
            if lattice.moves[move, i, j]:
                heapq.heappush(queue, (metres + length, (i + dx, j + dy)))
            back = (i - dx, j - dy)
            inside = 0 <= back[0] < lattice.shape[0] and 0 <= back[1] < lattice.shape[1]
            if inside and lattice.moves[move, *back]:
                heapq.heappush(queue, (metres + length, back))
    return done


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.3, 0.6]))
def test_distances_agree_with_plain_loops(seed, blocked):
    free = np.random.default_rng(seed).random((6, 5)) >= blocked
    lattice = lattice_of(free)
    distances = distances_over(lattice)
    for i, j in np.ndindex(free.shape):
        found = shortest(lattice, {(i, j): 0.0})
        for p, q in found:
            # Some dozen roundings of numbers below ten.
            assert distances.between(np.array(5 * i + j), np.array(5 * p + q)) == pytest.approx(
                found[p, q], abs=1e-14
            )


def visible_from(lattice, x, y):
    """Border positions whose straight line from (x, y) does not enter the lattice."""
    (nx, ny), entries = lattice.shape, {}
    for i, j in np.ndindex(nx, ny):
        p, q = position(lattice, i, j)
        # Ten points along the line, none of them strictly inside.
        line = [(x + t * (p - x), y + t * (q - y)) for t in np.linspace(0.05, 0.95, 10)]
        low, high = position(lattice, 0, 0), position(lattice, nx - 1, ny - 1)
        if not any(low[0] < a < high[0] and low[1] < b < high[1] for a, b in line):
            entries[i, j] = math.dist((x, y), (p, q))
    return entries


@pytest.mark.parametrize("x", [-1.7, -0.77, -0.2])
@pytest.mark.parametrize("y", [0.9, 2.33, 3.4])
def test_from_outside_the_robot_drives_straight_to_the_border(x, y):
    free = np.ones((6, 5), dtype=bool)
    free[1:-1, 2] = False
    lattice = lattice_of(free)
    low, high = position(lattice, 0, 0), position(lattice, 5, 4)
    outside = not (low[0] <= x <= high[0] and low[1] <= y <= high[1])
    found = distances_over(lattice).from_position(x, y)
    if outside:
        expected = shortest(lattice, visible_from(lattice, x, y))
    else:
        i, j = math.floor((x + 1.0) / 0.1), math.floor((y - 2.0) / 0.2)
        corners = itertools.product((i, i + 1), (j, j + 1))
        movable = {c: math.dist((x, y), position(lattice, *c)) for c in corners if free[c]}
        expected = shortest(lattice, movable)
    for i, j in np.ndindex(free.shape):
        assert found[5 * i + j] == pytest.approx(expected.get((i, j), math.inf), abs=1e-14)


def test_around_a_bed():
    """Two positions on both sides of a bed: 1.8 m along the line, 4 m around its end."""
    free = np.ones((41, 41), dtype=bool)
    free[:31, 12:29] = False  # 3 m along x from the wall, 1.6 m wide
    lattice = lattice_of(free, step=(0.1, 0.1))
    one, other = position(lattice, 20, 11), position(lattice, 20, 29)
    distances = LatticeDistances(np.array([one, other]), lattice)
    # 11 steps to beyond the end, 18 across, 11 back; the corners cannot be cut.
    assert distances.between(np.array(0), np.array(1)) == pytest.approx(4.0, abs=1e-12)
    np.testing.assert_allclose(distances.from_position(*one), [0.0, 4.0], atol=1e-12)


def test_a_walled_position_is_unreachable():
    free = np.ones((7, 7), dtype=bool)
    free[2:5, 2:5] = False
    free[3, 3] = True
    lattice = lattice_of(free)
    distances = distances_over(lattice)
    assert distances.from_position(0.0, 0.0)[7 * 3 + 3] == math.inf
    with pytest.raises(SelectionError, match=r"collision at \(-0.75, 2.50\) m"):
        distances.from_position(-0.75, 2.5)


@pytest.mark.parametrize("seed", range(5))
def test_a_path_is_as_long_as_the_distance(seed):
    rng = np.random.default_rng(seed)
    lattice = lattice_of(rng.random((7, 6)) > 0.2)
    distances = distances_over(lattice)
    x, y = position(lattice, 2.5, 2.5)
    try:
        metres = distances.from_position(x, y)
    except SelectionError:
        pytest.skip("the robot is in collision")
    first, second = (int(i) for i in rng.choice(np.flatnonzero(np.isfinite(metres)), 2))
    path = distances.path(x, y, [first, second], np.zeros(2), np.ones(2))
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    between = distances.between(np.array(first), np.array(second))
    # Moves outside the rectangle count a billionth more.
    assert length == pytest.approx(metres[first] + between, rel=1e-8)
    np.testing.assert_allclose(path[-1], distances.cell_xy[second])


@pytest.mark.parametrize("row", [0, 2])
def test_of_equally_short_paths_one_stays_inside(row):
    free = np.ones((3, 3), dtype=bool)
    free[1, 1] = False
    lattice = lattice_of(free, step=(0.2, 0.2))
    distances = distances_over(lattice)
    low, high = position(lattice, 0, min(row, 1)), position(lattice, 2, max(row, 1))
    path = distances.path(*position(lattice, 0, 1), [1, 7], np.array(low), np.array(high))
    assert np.all((path >= np.array(low) - 1e-9) & (path <= np.array(high) + 1e-9))
