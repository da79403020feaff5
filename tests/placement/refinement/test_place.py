"""Placement for tool poses given as arrays: laws, poses of known postures, continuity."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

import tcs
from tcs.errors import TaskError, TcsError
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec


def line(length, count=8):
    """Return tool poses along y, its x axis downwards."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    poses[:, :3, 3] = np.linspace([0.1, -length / 2, 0.4], [0.1, length / 2, 0.4], count)
    return poses


@pytest.fixture(scope="module")
def placed():
    return tcs.place("iiwa7", line(0.3))


def test_drake_confirms_the_joints(placed):
    scene = Scene(SceneSpec(load_robot("iiwa7"), EMPTY_ENVIRONMENT))
    (stop,) = placed.stops
    assert placed.reached.all()
    for pose, q in zip(line(0.3), placed.joints, strict=True):
        scene.place_base(stop.base_x, stop.base_y, stop.base_yaw)
        scene.set_arm(q)
        np.testing.assert_allclose(scene.tool_pose().GetAsMatrix4(), pose, atol=2e-6)
        assert not scene.violations()


def test_a_path_moves_the_joints_little(placed):
    assert placed.continuous == (True,)
    # 4 cm of the tool from pose to pose, half a metre from the base.
    assert np.abs(np.diff(placed.joints, axis=0)).max() < 0.5


def test_region_and_obstacles_are_respected(placed):
    region = ((0.2, 0.7), (-0.4, 0.1))
    found = tcs.place("iiwa7", line(0.3), region=region)
    (stop,) = found.stops
    assert region[0][0] <= stop.base_x <= region[0][1]
    assert region[1][0] <= stop.base_y <= region[1][1]
    around = tcs.Obstacle(x=0.1, y=0.0, width=3.0, depth=3.0, z_high=1.5)
    found = tcs.place("iiwa7", line(0.3), obstacles=[around])
    assert found.stops == ()
    assert found.reachability == 0.0
    assert not found.joints.any()


def test_a_finer_grid_is_tried_where_the_first_does_not_suffice(monkeypatch):
    module = importlib.import_module("tcs.placement.refinement.place")
    best = module._best

    def worse(scorer, scene, fineness):
        bases = best(scorer, scene, fineness)
        if fineness is module.FIRST:
            bases = [base._replace(reached=base.reached & (np.arange(8) > 0)) for base in bases]
        return bases

    monkeypatch.setattr(module, "_best", worse)
    region = ((0.4, 0.7), (-0.2, 0.2))
    assert tcs.place("iiwa7", line(0.3), region=region).reached.all()


def test_poses_too_far_apart_need_two_stops():
    apart = np.concatenate([line(0.1, 2), line(0.1, 2)])
    apart[2:, 0, 3] += 4.0
    one = tcs.place("iiwa7", apart, region=((-0.6, 4.6), (-0.6, 0.6)))
    assert one.reachability == 0.5
    assert sorted(one.stop.tolist()) == [-1, -1, 0, 0]
    two = tcs.place("iiwa7", apart, region=((-0.6, 4.6), (-0.6, 0.6)), stops=2)
    assert two.reachability == 1.0
    assert len(two.stops) == len(two.continuous) == 2


@pytest.mark.parametrize(
    ("poses", "options", "error", "message"),
    [
        (np.eye(4), {}, TaskError, "must be finite homogeneous matrices"),
        (np.full((1, 4, 4), np.nan), {}, TaskError, "finite"),
        (2.0 * line(0.1), {}, TaskError, "a rotation and a translation"),
        (line(0.1), {"stops": 0}, TcsError, "stops is 0"),
        (line(0.1), {"region": ((1.0, 0.0), (0.0, 1.0))}, TcsError, "is empty"),
    ],
    ids=["one matrix", "nan", "scaled", "stops", "region"],
)
def test_invalid_requests_are_refused(poses, options, error, message):
    with pytest.raises(error, match=message):
        tcs.place("iiwa7", poses, **options)
