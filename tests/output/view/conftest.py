from __future__ import annotations

import numpy as np
import pytest

from tcs.output.view import SceneObjects, ViewedSet
from tcs.placement.tables import ScoreTable, SuccessTable
from tests.placement.tables.small import random_scores, small_grid


def made(grid, goals, members, *, share=0.5, success=None) -> ViewedSet:
    """Return a set with random scores."""
    return ViewedSet(grid, random_scores(grid, goals, seed=3, share=share), members, success)


@pytest.fixture
def bed() -> ViewedSet:
    """Random scores for a bed with three heights and two head rest angles."""
    return made(small_grid(bed=3, head=2), 4, (50, 200))


@pytest.fixture
def estimated(bed) -> ViewedSet:
    """The same, with estimates of success of two singles and a pair."""
    none = -1
    table = SuccessTable(
        members=np.array([[50, none], [98, none], [50, 200]], np.int32),
        success=np.array([0.25, 0.75, 0.9]),
        low=np.array([0.2, 0.7, 0.85]),
        high=np.array([0.3, 0.8, 0.95]),
        samples=np.full(3, 100, np.int32),
    )
    return ViewedSet(bed.grid, bed.scores, bed.members, table)


@pytest.fixture
def shaving_set(shaving) -> ViewedSet:
    """Random scores for shaving in the wheelchair, which no scene produced."""
    return made(small_grid(), len(shaving.goals), (5, 30))


@pytest.fixture
def objects(scene, shaving, shaving_set) -> SceneObjects:
    """The objects of the scene, with the robot as its collision shapes."""
    return SceneObjects(scene, shaving, shaving_set, meshes=False)


def one_configuration(reason, pair=None) -> ScoreTable:
    """The scores of a single configuration, by the reasons of its goals."""
    reason = np.array([reason], np.uint8)
    reached = reason == 0
    return ScoreTable(
        dexterity=np.where(reached, np.float32(0.5), np.float32(0.0)),
        reason=reason,
        pair=np.array([pair or [-1] * reason.size], np.int32),
        pair_names=(("forearm", "head"),),
        arm_joints=np.zeros((int(reached.sum()), 7), np.float32),
        weights=np.full(reason.size, 1.0 / reason.size),
    )
