"""Contacts of an arm that moves in small steps: the same as Drake's search among all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.robots import load_robot
from tcs.model.scene import NeighbourList, Scene, SceneSpec, load_environment
from tcs.model.scene.neighbours import CLUSTER, _clusters
from tests.chosen import some_of

REACHING = np.array([0.3, 0.2, 0.5, -1.2, 0.4, -0.8, 0.2])


@pytest.fixture(scope="module")
def listed(_one_scene):
    return NeighbourList(_one_scene)


@pytest.fixture
def neighbours(scene, listed):
    """Those of the PR2 beside the wheelchair."""
    scene.place_base(0.6, -0.9, 0.8)
    scene.set_torso(0.3)
    return listed


def test_pairs_are_those_that_drake_checks(wheelchair):
    scene = Scene(SceneSpec(load_robot("iiwa7"), wheelchair))
    parts, pairs = scene.built.parts, NeighbourList(scene)._pairs
    ours = {frozenset((parts[a].geometry, parts[b].geometry)) for a, b in pairs}
    assert len(ours) == len(pairs)
    candidates = scene.query_object().inspector().GetCollisionCandidates()
    assert ours == set(map(frozenset, candidates))


def test_contacts_on_a_path_are_those_of_all_pairs(neighbours, rng):
    scene = neighbours.scene
    lower, upper = (np.clip(limit, -3.0, 3.0) for limit in scene.arm_limits)
    touched = free = 0
    for _ in range(3):
        end = rng.uniform(lower, upper)
        # Short steps first, then ones beyond the skin.
        for part in np.concatenate([np.linspace(0.0, 0.06, 4), np.linspace(0.1, 1.0, 6)]):
            scene.set_arm(REACHING + part * (end - REACHING))
            expected = scene.violations()
            found = neighbours.violations()
            assert [c[:2] for c in found] == [c[:2] for c in expected]
            np.testing.assert_allclose([c[2] for c in found], [c[2] for c in expected], atol=1e-9)
            touched += bool(found)
            free += not found
    assert min(touched, free) > 2


@pytest.mark.parametrize(
    ("robot", "environment"),
    some_of([("pr2", "wheelchair"), ("stretch", "bed")], ("stretch", "bed")),
)
def test_contacts_anywhere_are_those_of_all_pairs(robot, environment, rng):
    """Postures that have nothing to do with one another: all clusters of shapes are sought anew."""
    scene = Scene(SceneSpec(load_robot(robot), load_environment(environment)))
    neighbours = NeighbourList(scene)
    lower, upper = (np.clip(limit, -3.0, 3.0) for limit in scene.arm_limits)
    touched, bodies = 0, set()
    for _ in range(40):
        scene.place_base(*rng.uniform([-1.2, -1.2, -3.0], [1.2, 1.2, 3.0]))
        scene.set_torso(rng.uniform(*scene.built.torso_limits))
        scene.set_arm(rng.uniform(lower, upper))
        expected, found = scene.violations(), neighbours.violations()
        assert [c[:2] for c in found] == [c[:2] for c in expected]
        np.testing.assert_allclose([c[2] for c in found], [c[2] for c in expected], atol=1e-9)
        touched += bool(found)
        bodies |= {c[:2] for c in found}
    assert touched > 10
    assert len(bodies) > 20


def test_contacts_that_begin_before_pairs_are_sought_again_are_seen(neighbours, rng):
    scene, new = neighbours.scene, 0
    lower, upper = (np.clip(limit, -3.0, 3.0) for limit in scene.arm_limits)
    for _ in range(25):
        q = rng.uniform(lower, upper)
        scene.set_arm(q)
        neighbours._seek()
        before = {c[:2] for c in scene.violations()}
        # At most some 3 cm for each joint at a metre from it: less than the skin.
        scene.set_arm(q + rng.choice([-0.03, 0.03]) * np.eye(7)[rng.integers(5)])
        expected, found = scene.violations(), neighbours.violations()
        assert [c[:2] for c in found] == [c[:2] for c in expected]
        new += len({c[:2] for c in expected} - before)
    assert new > 0


def test_clusters_are_of_one_body_and_hold_each_shape_once(scene, listed):
    parts = scene.built.parts
    cluster = _clusters(listed._body, listed._boxes.X_BG[:, :, 3])
    members = [np.flatnonzero(cluster == i) for i in range(cluster.max() + 1)]
    assert sorted(np.concatenate(members)) == list(range(len(parts)))
    assert all(len({parts[i].body for i in rows}) == 1 for rows in members)
    assert max(map(len, members)) <= CLUSTER
    assert len(members) < len(parts) / 4


def test_pairs_are_sought_again_when_the_base_moves(neighbours):
    scene = neighbours.scene
    scene.set_arm(REACHING)
    before = neighbours.violations()
    # The person sits at the origin.
    scene.place_base(0.0, 0.0, 0.0)
    assert neighbours.violations() == scene.violations() != before


def test_a_tiny_motion_into_contact_is_seen(neighbours, rng):
    """The step is far below the skin, so no pairs are sought between the two postures."""
    scene = neighbours.scene
    lower, upper = (np.clip(limit, -3.0, 3.0) for limit in scene.arm_limits)
    free, touching = REACHING, REACHING
    while not scene.violations():
        touching = rng.uniform(lower, upper)
        scene.set_arm(touching)
    # A millimetre of motion and less.
    while np.abs(touching - free).max() > 1e-3:
        middle = 0.5 * (free + touching)
        scene.set_arm(middle)
        free, touching = (free, middle) if scene.violations() else (middle, touching)
    scene.set_arm(free)
    assert neighbours.violations() == ()
    scene.set_arm(touching)
    assert neighbours.violations()
