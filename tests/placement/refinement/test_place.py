"""Placement for tool poses given as arrays: laws, poses of known postures, continuity."""

from __future__ import annotations

import numpy as np
import pytest

import tcs
from tcs.errors import TaskError, TcsError
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec
from tcs.placement.refinement import base_poses
from tcs.placement.refinement.base_poses import PoseScene, PoseScorer, joint_path


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
    best = base_poses._best

    def worse(scorer, scene, fineness):
        bases = best(scorer, scene, fineness)
        if fineness is base_poses.FIRST:
            bases = [base._replace(reached=base.reached & (np.arange(8) > 0)) for base in bases]
        return bases

    monkeypatch.setattr(base_poses, "_best", worse)
    region = ((0.4, 0.7), (-0.2, 0.2))
    assert tcs.place("iiwa7", line(0.3), region=region).reached.all()


def test_base_poses_far_from_each_other_are_tried_where_the_best_have_no_path(monkeypatch):
    tried = []

    def blocked_near_the_best(problem, row, through=None):
        base = np.array([row.x[0], row.y[0]])
        tried.append(base)
        is_far = np.linalg.norm(base - tried[0]) > 0.25
        return joint_path(problem, row, through) if is_far else None

    monkeypatch.setattr(base_poses, "joint_path", blocked_near_the_best)
    found = tcs.place("iiwa7", line(0.3), region=((0.2, 0.9), (-0.6, 0.6)))
    assert found.reached.all()
    assert found.continuous == (True,)
    assert len(tried) > base_poses.FIRST.screened
    assert len(tried) <= base_poses.FIRST.screened + base_poses.SPREAD.screened


def test_base_poses_are_scored_alike_together_and_alone():
    scene = PoseScene.of(load_robot("iiwa7"), (), 0.0, DEFAULT_MEASURE)
    x, y, yaw = np.meshgrid([0.0, 0.4, 0.6], [-0.2, 0.1], [0.0, 2.0, 4.0], indexing="ij")
    values = np.stack([x, y, yaw, np.zeros_like(x)], axis=-1).reshape(-1, 4)
    values = np.random.default_rng(0).permutation(values)
    scorer = PoseScorer.of(scene, line(0.3), None, jobs=2)
    points = values
    together = scorer.score(points)
    assert 0 < together.reached.sum() < together.reached.size
    for i in range(len(values)):
        alone = scorer.score(values[i : i + 1])
        for array, row in zip(together, alone, strict=True):
            np.testing.assert_array_equal(array[i : i + 1], row)


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
