"""Selection among sets that can be executed, against a search of all sets."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError
from tcs.placement.constraints import Obstacle
from tcs.placement.selection import Executability, SelectionTables
from tcs.placement.tables import tc_manipulability, tc_reachability
from tests.placement.store.example import score_file
from tests.placement.store.test_motion_file import motion_file, motion_table

HERE = tcs.InitialConfiguration(
    base_x=0.0,
    base_y=0.0,
    base_yaw=0.0,
    torso=0.0,
    environment=(("bed_height", 0.0),),
    environment_units=("m",),
)
WEIGHTS = tcs.UtilityWeights(travel=0.0, places=0.0, environment=0.0)


@pytest.mark.parametrize("seed", range(2))
def test_the_best_set_is_that_of_what_can_be_done(seed):
    file = score_file()
    sets = file.nominal.sets
    rng = np.random.default_rng(seed)
    done = rng.random(sets.reached.shape) < 0.7
    rows = np.sort(rng.choice(len(sets.candidates), len(sets.candidates) // 2, replace=False))
    motions = motion_file(motion_table(sets, done, rows))
    chosen = tcs.select(file, HERE, weights=WEIGHTS, motions=motions)
    assert set(np.searchsorted(sets.candidates, chosen.indices)) <= set(rows)

    reached = sets.reached & done
    dexterity = np.where(reached, sets.dexterity, 0.0)
    least = sets.limits
    totals = []
    for members in itertools.chain(
        itertools.combinations(rows, 1), itertools.combinations(rows, 2)
    ):
        at = list(members)
        reach = tc_reachability(reached[at].any(axis=0), sets.weights)
        able = tc_manipulability(dexterity[at].max(axis=0), sets.weights)
        if len(at) == 2:
            first, second = (sets.cell_xy[sets.cell[row]] for row in at)
            kept = np.linalg.norm(first - second) >= sets.min_distance - 1e-9
            kept &= not sets.same_environment or sets.state[at[0]] == sets.state[at[1]]
            stored = sets.scores_of(tuple(int(h) for h in sets.candidates[at]))
            kept &= stored[0] >= least.reachability and stored[1] >= least.manipulability
            if not kept:
                continue
        totals.append(float(reach + able))
    assert chosen.reachability + chosen.manipulability == pytest.approx(max(totals), abs=1e-6)


def test_what_it_costs():
    file = score_file()
    sets = file.nominal.sets
    best = tcs.select(file, HERE, weights=WEIGHTS)
    done = np.ones(sets.reached.shape, bool)
    done[np.searchsorted(sets.candidates, best.indices)] = False
    motions = motion_file(motion_table(sets, done))
    chosen = tcs.select(file, HERE, weights=WEIGHTS, motions=motions)
    compared = Executability.of(file, motions, chosen, best).to_json(chosen)
    assert compared["by_postures"]["reachability_done"] == 0.0
    assert compared["costs"]["utility"] == pytest.approx(best.utility - chosen.utility)
    few = motion_file(motion_table(sets, done, np.searchsorted(sets.candidates, chosen.indices)))
    compared = Executability.of(file, few, chosen, best).to_json(chosen)
    assert compared["examined"] == len(chosen.indices)
    assert compared["by_postures"]["examined"] is False
    assert compared["by_postures"]["reachability_done"] is None


def test_what_motions_do_not_cover_is_refused():
    file = score_file()
    sets = file.nominal.sets
    motions = motion_file(motion_table(sets, np.zeros(sets.reached.shape, bool)))
    with pytest.raises(SelectionError, match="Examine more"):
        tcs.select(file, HERE, motions=motions)
    with pytest.raises(SelectionError, match="single table"):
        tcs.select(SelectionTables.of(file), HERE, motions=motions)
    blocked = tcs.Constraints(blocked=(Obstacle.parse("9 9 0.1 0.1"),))
    with pytest.raises(SelectionError):
        tcs.select(file, HERE, constraints=blocked, motions=motions)
    with pytest.raises(SelectionError, match="--observed"):
        tcs.select(file, HERE, motions=motion_file(None))
