"""Poses out of transforms, judged by Drake's rigid transforms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from tcs.errors import ServiceError, TcsError, UnknownNameError
from tcs.service.ros import Pose, TransformTree


def drawn(rng) -> RigidTransform:
    return RigidTransform(RollPitchYaw(rng.uniform(-3, 3, 3)), rng.uniform(-2, 2, 3))


def pose_of(X: RigidTransform) -> Pose:
    w, x, y, z = X.rotation().ToQuaternion().wxyz()
    return Pose.of_quaternion(X.translation(), np.array([x, y, z, w]))


def test_poses_are_those_of_drake(rng):
    for _ in range(50):
        X_AB, X_BC = drawn(rng), drawn(rng)
        pose = pose_of(X_AB).inverse() @ pose_of(X_BC)
        expected = X_AB.inverse() @ X_BC
        np.testing.assert_allclose(pose.p_AoBo_A, expected.translation(), atol=1e-12)
        np.testing.assert_allclose(pose.R_AB, expected.rotation().matrix(), atol=1e-12)
        back = RotationMatrix(Quaternion(np.array(pose.quaternion_wxyz())))
        np.testing.assert_allclose(back.matrix(), pose.R_AB, atol=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_quaternions_of_half_turns(axis):
    """The scalar part is zero: each of the other components divides once."""
    xyzw = np.zeros(4)
    xyzw[axis] = 1.0
    pose = Pose.of_quaternion(np.zeros(3), xyzw)
    wxyz = np.array(pose.quaternion_wxyz())
    np.testing.assert_allclose(np.abs(wxyz), np.roll(xyzw, 1), atol=1e-12)


def test_frames_of_a_tree(rng):
    tree, poses = TransformTree(max_age=5.0), [drawn(rng) for _ in range(4)]
    # map -> odom -> base, map -> marker -> person
    for parent, child, pose in zip(
        ("map", "/odom", "map", "marker"), ("odom", "base", "marker", "person"), poses, strict=True
    ):
        tree.set(parent, child, pose_of(pose), is_static=child == "marker")
    expected = (poses[2] @ poses[3]).inverse() @ poses[0] @ poses[1]
    found = tree.pose("base", within="person")
    np.testing.assert_allclose(found.p_AoBo_A, expected.translation(), atol=1e-12)
    np.testing.assert_allclose(found.R_AB, expected.rotation().matrix(), atol=1e-12)
    np.testing.assert_array_equal(tree.pose("map", within="map").R_AB, np.eye(3))


def test_heading_of_an_upright_base():
    tilt = math.radians(4.0)
    X = RigidTransform(RollPitchYaw(tilt, 0.0, math.radians(30.0)), [1.0, 2.0, 0.1])
    assert pose_of(X).base_pose() == pytest.approx((1.0, 2.0, 30.0))
    X = RigidTransform(RollPitchYaw(math.radians(6.0), 0.0, 0.0), np.zeros(3))
    with pytest.raises(ServiceError, match="tilted by 6 deg"):
        pose_of(X).base_pose()


def test_missing_old_and_looping_transforms(monkeypatch):
    tree, still = TransformTree(max_age=2.0), Pose(np.zeros(3), np.eye(3))
    tree.set("map", "base", still, is_static=False)
    tree.set("world", "bed", still, is_static=True)
    with pytest.raises(UnknownNameError, match=r"tf: unknown frame 'bsae'.*Did you mean 'base'"):
        tree.pose("bsae", within="map")
    with pytest.raises(ServiceError, match="does not connect the frames 'base' and 'bed'"):
        tree.pose("base", within="bed")
    clock = {"now": 1.0e9}
    monkeypatch.setattr("tcs.service.ros.frames.time.monotonic", lambda: clock["now"])
    tree.set("map", "base", still, is_static=False)
    clock["now"] += 2.1
    with pytest.raises(ServiceError, match=r"'base' is 2\.1 s old, more than 2 s"):
        tree.pose("base", within="map")
    tree.pose("bed", within="world")
    tree.set("a", "b", still, is_static=True)
    tree.set("b", "a", still, is_static=True)
    with pytest.raises(ServiceError, match="form a loop"):
        tree.pose("a", within="map")


@pytest.mark.parametrize("xyzw", [(0, 0, 0, 0), (0, 0, 0, 2), (0, 0, math.nan, 1)])
def test_quaternions_that_are_none(xyzw):
    with pytest.raises(TcsError, match="of norm 1"):
        Pose.of_quaternion(np.zeros(3), np.array(xyzw, dtype=float))
