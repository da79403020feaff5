"""Memory of dropped diagrams: it is freed, and what somebody holds stays."""

from __future__ import annotations

import gc

import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import Diagram

from tcs.model import diagrams
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, SceneSpec, environment_shapes
from tcs.model.scene.plant import build_plant
from tcs_shapes.self_collision import SelfCollision


@pytest.fixture
def alive():
    """Function that counts the diagrams that were built in the test and are not freed.

    No search for garbage happens by chance.
    """
    # Held: a new diagram cannot take the place in memory of one of these.
    before = _diagrams()
    gc.disable()
    yield lambda: sum(all(found is not old for old in before) for found in _diagrams())
    gc.enable()


def _diagrams():
    return [found for found in gc.get_objects() if type(found) is Diagram]


def _scene():
    return build_plant(SceneSpec(load_robot("ur5"), EMPTY_ENVIRONMENT))


def _dropped():
    builder = diagrams.diagram_builder()
    AddMultibodyPlantSceneGraph(builder, 0.0)
    builder.Build()


def test_of_many_dropped_diagrams_few_remain(alive):
    remaining = []
    for _ in range(2 * diagrams.PERIOD):
        _dropped()
        remaining.append(alive())
    # Whatever number the count has when the test begins.
    assert max(remaining[diagrams.PERIOD :]) == diagrams.PERIOD


@pytest.mark.parametrize(
    "build",
    [
        _scene,
        lambda: environment_shapes(EMPTY_ENVIRONMENT),
        lambda: SelfCollision(load_robot("ur5")),
    ],
    ids=["scene", "shapes of an environment", "self-collision"],
)
def test_whatever_builds_a_diagram_frees_the_one_before(alive, monkeypatch, build):
    monkeypatch.setattr(diagrams, "PERIOD", 1)
    build()
    build()
    assert alive() == 1


def test_a_plant_that_is_held_stays_valid(alive, monkeypatch):
    monkeypatch.setattr(diagrams, "PERIOD", 1)
    plant = _scene().plant
    diagrams.diagram_builder()
    assert alive() == 1
    assert plant.GetJointByName("base_yaw").num_positions() == 1
    del plant
    diagrams.diagram_builder()
    assert alive() == 0
