"""Windows of stops of the PR2: no pose inside misses a goal, one just outside does."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import tcs
from tcs.placement.constraints import Obstacle
from tcs.placement.parking import find_windows
from tcs.placement.parking.search import lattice
from tcs.placement.parking.stop import BASE
from tcs.placement.parking.windows import _prepared
from tcs.placement.refinement import PointScorer
from tcs.placement.scoring.drake_check import DrakeChecker
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.selection import ServedStop
from tcs.placement.tables import Window
from tests.beside import BESIDE

POSES = 1000


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    path = tmp_path_factory.mktemp("beside") / "beside.yaml"
    path.write_text(BESIDE)
    return path


@pytest.fixture(scope="module")
def scored(environment):
    return tcs.score("shaving", environment)


@pytest.fixture(scope="module")
def scorer(scored):
    return PointScorer.of(scored, 0)


def stop_of(file, h, goals):
    values = np.array([*file.configurations.values(h).values()])
    mask = np.zeros(file.nominal.sets.weights.size, np.bool_)
    mask[goals] = True
    return ServedStop(values, mask)


def widest_stop(file):
    """The stop that reaches a goal, the one with the greatest window for a single goal of some."""
    scores, best = file.nominal.scores, None
    rows, goals = np.nonzero(scores.reached)
    for h, g in list(zip(rows.tolist(), goals.tolist(), strict=True))[:: max(1, len(rows) // 12)]:
        stop = stop_of(file, h, [g])
        window = find_windows(file, 0, stop, None).window(*stop)
        if min(window) > 0.0 and (best is None or window.volume > best[1].volume):
            best = stop, window
    return best


@pytest.fixture(scope="module")
def parked(scored):
    return widest_stop(scored)


def missed(scorer, stop, offsets):
    """Whether a pose misses a goal, by the scorer of the grid with its own measure."""
    points = np.repeat(stop.values[None], len(offsets), axis=0)
    points[:, BASE] += offsets
    return ~scorer.score(points).reached[:, stop.goals].all(axis=1)


def test_nothing_is_missed_inside(scorer, parked, rng):
    stop, window = parked
    assert min(window.x, window.y) > 0.003
    assert not missed(scorer, stop, lattice(5) * np.array(window)).any()
    assert not missed(scorer, stop, rng.uniform(-1, 1, (POSES, 3)) * np.array(window)).any()


def test_a_window_cannot_be_a_quarter_wider(scorer, parked, rng):
    stop, window = parked
    wider = np.minimum(1.25 * np.array(window), (0.5, 0.5, math.pi))
    around = [lattice(9) * wider, rng.uniform(-1, 1, (POSES, 3)) * wider]
    assert missed(scorer, stop, np.concatenate(around)).any()


def test_drake_agrees_inside(scored, scorer, parked, rng):
    stop, window = parked
    (job, scene, _) = rebuild_scenes(scored)[0]
    checker = DrakeChecker(job, scene, scored.metadata["measure"])
    points = np.repeat(stop.values[None], 24, axis=0)
    points[:, BASE] += rng.uniform(-1, 1, (24, 3)) * np.array(window)
    points[:8, BASE] = stop.values[BASE] + lattice(3)[:8] * np.array(window)
    found = scorer.score(points)
    names = [axis.name for axis in scored.configurations.axes]
    for row in range(len(points)):
        at = dict(zip(names, points[row].tolist(), strict=True))
        for g in np.flatnonzero(stop.goals).tolist():
            q = found.joints[row, g].astype(np.float64)
            assert checker.check_at(at, g, q, found.dexterity[row, g]).is_true


def test_a_window_ends_at_the_furniture(environment, scored, parked):
    stop, free = parked
    x, y, _ = stop.values[BASE]
    # A low box away from the person, as far off the square base of the PR2 as half the window.
    gap, half, side = 0.5 * free.y, 0.334, math.copysign(1.0, y)
    box = Obstacle(x=x, y=y + side * (half + gap + 0.1), width=3.0, depth=0.2, z_high=0.2)
    beside = tcs.score("shaving", environment, constraints=tcs.Constraints(blocked=(box,)))
    here = find_windows(beside, 0, stop, None).window(*stop)
    assert here is not None
    assert here.y <= gap
    assert here.y < free.y


def test_windows_are_the_same_again_and_hold_what_is_wanted(scored, parked):
    stop, window = parked
    assert find_windows(scored, 0, stop, None).window(*stop) == window
    less = Window(*(0.6 * half for half in window))
    held = find_windows(scored, 0, stop, less).window(*stop)
    assert held.holds(less)
    more = Window(*np.minimum(2.0 * np.array(window), (0.5, 0.5, math.pi)))
    table = find_windows(scored, 0, stop, more)
    assert table.window(*stop, more) is None
    assert table.missed(stop.values, more)[stop.goals].all()


def test_what_a_hand_off_its_place_reaches_is_what_the_scorer_says(scored, scorer, rng):
    # All goals of a stop, misses too: the scorer of windows against that of the grid.
    h = int(np.argmax(scored.nominal.scores.reached.sum(axis=1)))
    goals = np.flatnonzero(scored.nominal.scores.reached[h]).tolist()
    stop = stop_of(scored, h, goals)
    offsets = rng.uniform(-1, 1, (200, 3)) * [0.15, 0.15, 0.3]
    ours = _prepared(scored, 0, None).at(stop.values, goals).missed(offsets)
    points = np.repeat(stop.values[None], len(offsets), axis=0)
    points[:, BASE] += offsets
    theirs = ~scorer.score(points).reached[:, goals]
    assert theirs.any()
    assert not theirs.all()
    np.testing.assert_array_equal(ours, theirs)


def test_one_call_selects_and_finds(scored):
    file = dataclasses.replace(scored)
    found = tcs.select(file, parking=(0.005, 0.005, 0.3))
    assert all(window.holds(Window.wanted((0.0, 0.0, 0.0))) for window in found.windows)
    again = tcs.placement.selection.select(file, parking=(0.005, 0.005, 0.3))
    assert again.windows == found.windows


@pytest.mark.slow
def test_of_many_random_poses_none_misses(scorer, parked, rng):
    stop, window = parked
    for _ in range(20):
        offsets = rng.uniform(-1, 1, (5000, 3)) * np.array(window)
        assert not missed(scorer, stop, offsets).any()
