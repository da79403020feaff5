"""Head and wrist cameras: where they are, what they see, and that rendering cannot stop driving."""

from __future__ import annotations

import io
import time

import numpy as np
import pytest
from PIL import Image

from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec
from tcs.output.view.teleop import cameras as module
from tcs.output.view.teleop.camera_pictures import (
    HEAD,
    OVERVIEW,
    SIZE,
    WRIST,
    camera_views,
    look_at,
)
from tcs.output.view.teleop.cameras import NO_EGL, Cameras
from tcs.teleop import load_arm


def test_a_camera_looks_at_its_point_with_z_up():
    X_WC = look_at(np.array([1.0, 0.0, 2.0]), np.array([3.0, 0.0, 1.0]))
    x, y, z = X_WC.rotation().matrix().T
    np.testing.assert_allclose(z, np.array([2.0, 0.0, -1.0]) / np.sqrt(5.0), atol=1e-12)
    # The right of the picture is to the right of the robot, and its bottom is down.
    np.testing.assert_allclose(x, [0.0, -1.0, 0.0], atol=1e-12)
    assert y[2] < 0.0


@pytest.mark.parametrize(("robot", "first"), [("tiago", HEAD), ("iiwa7", OVERVIEW)])
def test_the_first_camera_has_the_tool_in_its_middle(robot, first):
    arm = load_arm(robot)
    scene = Scene(SceneSpec(arm.robot, EMPTY_ENVIRONMENT))
    scene.set_torso(arm.torso_height)
    tool = arm.kinematics(0.5 * (np.maximum(arm.lower, -3) + np.minimum(arm.upper, 3))).p
    camera, wrist = camera_views(arm, scene, tool)
    assert (camera.name, wrist.name) == (first, WRIST)
    seen = camera.X_FC.inverse().multiply(tool)
    np.testing.assert_allclose(seen[:2], 0.0, atol=1e-9)
    assert seen[2] > 0.0


def _ends(pipe, arm, joints, interval):
    """Stand in for a process that finds no EGL."""


def _paints(pipe, arm, joints, interval):
    """Stand in for the renderer: a picture holds the first joint."""
    while True:
        pipe.send({"camera": f"{joints[0]:.1f}".encode()})
        joints = pipe.recv()


def until(done):
    end = time.monotonic() + 60.0
    while not done():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.slow
def test_a_process_that_ends_is_reported_and_harms_nothing(iiwa, ready, monkeypatch):
    monkeypatch.setattr(module, "_render", _ends)
    found = Cameras(iiwa, ready)
    until(lambda: found.fault == NO_EGL)
    found.show(ready)
    assert found.pictures() == {}
    found.close()


@pytest.mark.slow
def test_the_last_posture_is_painted(iiwa, ready, monkeypatch):
    monkeypatch.setattr(module, "_render", _paints)
    found = Cameras(iiwa, ready)
    until(found.pictures)
    assert found.pictures() == {"camera": b"0.0"}
    found.show(ready + 0.5)
    # A posture that arrives while the process is busy is not queued.
    found.show(ready + 0.7)
    until(lambda: found.pictures() != {"camera": b"0.0"})
    assert found.pictures()["camera"] in (b"0.5", b"0.7")
    found.close()
    assert found.fault == ""


@pytest.mark.slow
def test_pictures_show_the_arm_and_follow_it(iiwa, ready):
    found = Cameras(iiwa, ready)
    until(lambda: found.pictures() or found.fault)
    if found.fault:
        pytest.skip("needs EGL (apt install libegl1 libegl-mesa0)")
    first = found.pictures()
    assert set(first) == {OVERVIEW, WRIST}
    found.show(ready + 0.3)
    until(lambda: found.pictures() is not first)
    before, after = (
        np.asarray(Image.open(io.BytesIO(one[OVERVIEW])), dtype=float)
        for one in (first, found.pictures())
    )
    found.close()
    assert before.shape == (*SIZE[::-1], 3)
    # Sky and ground each have one colour; the corners of the picture are above and below the arm.
    sky, ground = before[0, 0], before[-1, 0]
    arm = np.min([np.abs(before - sky).max(axis=2), np.abs(before - ground).max(axis=2)], axis=0)
    assert 0.01 < (arm > 20.0).mean() < 0.6
    assert (np.abs(before - after).max(axis=2) > 40.0).mean() > 0.01
