"""The floor of a score file: success, motions and refined sets where the file holds them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.placement.store import ScoreFile, motion_path, save_motions, save_scores
from tcs.placement.tables import RefinedTable, SuccessTable
from tcs.service import Engine
from tcs.service.floor import floor_of, outcome_of
from tests.placement.store.example import score_file
from tests.placement.store.test_motion_file import motion_file, motion_table


@pytest.fixture
def file() -> ScoreFile:
    return score_file()


def with_tables(file, **tables) -> ScoreFile:
    """The file with further tables of its first observed state."""
    first, *others = file.tables
    return dataclasses.replace(file, tables=(dataclasses.replace(first, **tables), *others))


def values_at(floor, name):
    """The known values of a floor, by base position."""
    return {
        (x, y): floor[name][i][j]
        for i, x in enumerate(floor["x"])
        for j, y in enumerate(floor["y"])
        if floor[name][i][j] is not None
    }


def position(grid, configuration):
    at = grid.configuration(configuration)
    return (round(at.base_x, 6), round(at.base_y, 6))


def test_success_is_that_of_the_best_set_with_a_base_there(file):
    grid = file.configurations
    size = grid.state_size
    assert {"success", "motion"}.isdisjoint(floor_of(file, 0, 0))
    members = np.array([[1, -1], [2, -1], [1, size + 3]], np.int32)
    success = np.array([0.25, 0.5, 0.75])
    table = SuccessTable(
        members=members, success=success, low=success, high=success,
        samples=np.full(3, 100, np.int32),
    )  # fmt: skip
    estimated = with_tables(file, success=table)
    expected = [{}, {}]
    for h, value in ((1, 0.25), (2, 0.5), (1, 0.75), (size + 3, 0.75)):
        here = expected[h // size]
        here[position(grid, h)] = max(value, here.get(position(grid, h), 0.0))
    for state in (0, 1):
        assert values_at(floor_of(estimated, 0, state), "success") == expected[state]


def test_motion_is_the_weight_of_the_goals_that_can_be_done(file, tmp_path):
    grid, sets = file.configurations, file.tables[0].sets
    done = np.random.default_rng(0).random(sets.reached.shape) < 0.5
    table = motion_table(sets, done)
    motions = motion_file(*(table if i == 0 else None for i in range(len(file.tables))))
    seen = 0
    for state in (0, 1):
        of_state = grid.state_of(table.configurations) == state
        expected = {}
        for h, one in zip(table.configurations[of_state], table.done[of_state], strict=True):
            here = position(grid, int(h))
            weight = round(float(file.nominal.scores.weights[one].sum()), 4)
            expected[here] = max(weight, expected.get(here, 0.0))
        if expected:
            seen += 1
            floor = floor_of(file, 0, state, motions)
            assert values_at(floor, "motion") == pytest.approx(expected)
    assert seen
    # Motions that are saved beside the file are held with it.
    path = tmp_path / "scored.tcs"
    save_scores(path, file)
    with Engine() as engine:
        held = engine.open_file(path).file
        assert engine._files.known_motions(held) is None
        save_motions(motion_path(path), motions)
        engine.open_file(path)
        assert engine._files.known_motions(held) is not None


def test_a_refined_place_has_its_own_outcome(file):
    grid = file.configurations
    goals = file.nominal.sets.weights.size
    origin = int(file.nominal.sets.candidates[3])
    at = grid.configuration(origin)
    moved = dataclasses.replace(at, base_x=at.base_x + 0.01, base_yaw=at.base_yaw + 0.02)
    known = dict(moved.environment)
    values = [known.get(axis.name, getattr(moved, axis.name, None)) for axis in grid.axes]
    reached = np.arange(goals) % 2 == 0
    dexterity = np.where(reached, np.float32(0.5), np.float32(0.0))
    table = RefinedTable(
        origin=np.array([[origin]], np.int32),
        values=np.array([[values]]),
        reached=reached[None, None],
        dexterity=dexterity[None, None],
        arm_joints=np.zeros((1, 1, goals, 7), np.float32),
        objective=np.array([1.0]),
        weights=file.nominal.sets.weights,
    )
    refined = with_tables(file, refined=table)
    turned = dataclasses.replace(moved, base_yaw=moved.base_yaw + 2.0 * np.pi)
    outcome = outcome_of(refined, 0, turned)
    assert outcome["refined"]
    assert [goal["reached"] for goal in outcome["goals"]] == reached.tolist()
    assert {goal["reason"] for goal in outcome["goals"]} == {"reached", "unreached"}
    assert outcome["reachability"] == pytest.approx(table.weights[reached].sum())
    assert outcome["members"][0]["base_x"] == pytest.approx(at.base_x + 0.01)
    beside = dataclasses.replace(moved, base_x=moved.base_x + 0.001)
    for stated in (at, beside):
        assert not outcome_of(refined, 0, stated)["refined"]
        assert outcome_of(refined, 0, stated)["configuration"] == origin
