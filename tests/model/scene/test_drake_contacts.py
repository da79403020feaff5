"""Drake's search for contacts: made when first asked for, one for all scenes of a plant."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import Role

from tcs.model.robots import load_robot
from tcs.model.scene import Scene, SceneSpec
from tcs.model.scene import scene as scene_module
from tcs.model.scene.contacts import Group
from tcs.model.scene.plant import build_plant

REACHING = np.array([0.3, 0.2, 0.5, -1.2, 0.4, -0.8, 0.2])


@pytest.fixture(scope="module")
def spec(wheelchair):
    """The robot with the fewest shapes and the wheelchair."""
    return SceneSpec(load_robot("iiwa7"), wheelchair)


def test_a_scene_lists_no_pairs_of_the_robot_until_contacts_are_sought(spec, monkeypatch):
    built = build_plant(spec)
    monkeypatch.setattr(scene_module, "build_plant", lambda *_, **__: built)
    scene = Scene(spec)
    shapes = sum(part.group is Group.ENVIRONMENT for part in built.parts)

    def with_role(inspector):
        return inspector.NumGeometriesWithRole(Role.kProximity)

    scene.shape_pose(built.parts[0])
    assert with_role(built.scene_graph.model_inspector()) == shapes
    assert built.contacts._context is None
    scene.violations()
    assert with_role(built.scene_graph.model_inspector()) == shapes
    assert with_role(scene.query_object().inspector()) == len(built.parts)


def test_scenes_of_one_plant_see_their_own_contacts(spec, monkeypatch):
    built = build_plant(spec)
    monkeypatch.setattr(scene_module, "build_plant", lambda *_, **__: built)
    far, near = Scene(spec), Scene(spec)
    far.set_torso(0.15)
    far.set_arm(REACHING)
    far.place_base(3.0, 3.0, 0.0)
    # The person sits there.
    near.place_base(0.5, 0.0, 0.0)
    for _ in range(2):
        assert far.violations() == ()
        assert any(name.startswith("person::") for _, name, _ in near.violations())


def test_contacts_are_those_where_the_scene_is(spec):
    scene = Scene(spec)
    poses = {}
    for x in (0.4, 1.1):
        scene.place_base(x, -0.8, 0.3)
        scene.set_arm(REACHING)
        query = scene.query_object()
        poses[x] = np.array(
            [query.GetPoseInWorld(p.geometry).GetAsMatrix34() for p in scene.built.parts]
        )
        of_scene = [scene.shape_pose(part).GetAsMatrix34() for part in scene.built.parts]
        np.testing.assert_array_equal(poses[x], of_scene)
    assert np.abs(poses[0.4] - poses[1.1]).max() > 0.5
