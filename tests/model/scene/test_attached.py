"""Poses of shapes and goals composed for many states, against Drake's own."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.scene.contacts import Group


@pytest.mark.parametrize("group", [Group.BODY, Group.ENVIRONMENT])
def test_shapes_are_where_drake_has_them(scene, group):
    parts = [part for part in scene.built.parts if part.group is group]
    before = scene.positions()
    attached, frames, expected = scene.attached(group), [], []
    for torso, turn in ((0.0, 0.2), (0.21, -0.9)):
        scene.set_torso(torso)
        scene.place_base(0.3, -0.2, 1.0 + torso)
        scene.set_joint("head_turn", turn)
        scene.set_joint("head_tilt", turn / 10.0)
        frames.append(attached.frames_in_world(scene.plant_context))
        expected.append([scene.shape_pose(part).GetAsMatrix34() for part in parts])
    scene.restore(before)
    # One product of rotations of either order of rounding.
    np.testing.assert_allclose(attached.at(np.array(frames)), expected, atol=1e-12)
    assert len(attached.frames) < len(parts)
