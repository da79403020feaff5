"""Link frames chosen from the joint axes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.model.scene.chain import AXES_MEET, JointAxis, link_frames, meeting_points


def axis_through(point, direction, slide=0.0, turn=0.0):
    """An axis whose joint frame is at `slide` along it and rotated arbitrarily."""
    direction = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    R_AJ = Rotation.from_euler("xyz", [turn, 2 * turn, -turn]).as_matrix()
    return JointAxis(R_AJ, np.asarray(point) + slide * direction, R_AJ.T @ direction)


def arm(wrist_miss=0.0, shoulder_miss=0.0):
    S, W = np.array([0.1, 0.2, 0.3]), np.array([0.5, -0.1, 0.4])
    return (
        (
            axis_through([0, 0, 0], [0, 0, 1]),
            axis_through(S, [0, 1, 0], slide=0.3, turn=0.2),
            axis_through(S + np.array([0, 0, shoulder_miss]), [1, 1, 0], slide=-0.2, turn=0.5),
            axis_through([0.3, 0, 0.4], [0, 1, 0.2], turn=1.0),
            axis_through(W, [1, 0, 0], slide=0.4),
            axis_through(W, [0, 1, 0], slide=0.1, turn=0.3),
            # Parallel to axis 5 at zero, as in the PR2.
            axis_through(W + np.array([0, 0, wrist_miss]), [1, 0, 0], slide=-0.3, turn=0.7),
        ),
        S,
        W,
    )


def test_origins_are_moved_to_where_the_axes_meet():
    axes, S, W = arm()
    R_AL, p_AL = link_frames(axes)
    # A few roundings of numbers below 1.
    np.testing.assert_allclose(p_AL[[1, 2]], [S, S], atol=1e-15)
    np.testing.assert_allclose(p_AL[[4, 5, 6]], [W, W, W], atol=1e-15)
    np.testing.assert_array_equal(p_AL[[0, 3]], [axes[0].p_AJ, axes[3].p_AJ])
    for i, axis in enumerate(axes):
        np.testing.assert_allclose(R_AL[i][:, 2], axis.direction_A, atol=1e-15)
        np.testing.assert_allclose(R_AL[i] @ R_AL[i].T, np.eye(3), atol=1e-15)
        assert np.linalg.det(R_AL[i]) > 0


@pytest.mark.parametrize("miss", [2 * AXES_MEET, 0.01])
def test_origins_stay_where_axes_pass_each_other(miss):
    axes, _, _ = arm(wrist_miss=miss, shoulder_miss=miss)
    _, p_AL = link_frames(axes)
    for i in range(7):
        np.testing.assert_array_equal(p_AL[i], axes[i].p_AJ)


def test_axes_that_nearly_meet_keep_their_origins_on_themselves():
    axes, S, _ = arm(shoulder_miss=AXES_MEET / 2)
    _, p_AL = link_frames(axes)
    for i in (1, 2):
        offset = p_AL[i] - axes[i].p_AJ
        # An origin beside its axis would change the chain by as much.
        np.testing.assert_allclose(np.cross(offset, axes[i].direction_A), 0.0, atol=1e-15)
        assert np.linalg.norm(p_AL[i] - S) <= AXES_MEET


def test_parallel_axes_do_not_meet():
    a, b = axis_through([0, 0, 0], [0, 0, 1]), axis_through([0, 0, 5], [0, 0, -1])
    assert meeting_points(a, b) is None


def spherical_shoulder_arm(shoulder_miss=0.0, wrist_miss=0.0):
    """Axes 1, 2 and 3 meet in S, 5 and 6 in W; axis 7 passes them."""
    S, W = np.array([0.1, 0.2, 0.3]), np.array([0.5, -0.1, 0.4])
    return (
        (
            # Parallel to axis 3 at zero, as in the Panda.
            axis_through(S, [0, 0, 1], slide=-0.3, turn=0.1),
            axis_through(S, [0, 1, 0], slide=0.3, turn=0.2),
            axis_through(S + np.array([0, shoulder_miss, 0]), [0, 0, 1], slide=-0.2, turn=0.5),
            axis_through([0.3, 0, 0.4], [0, 1, 0.2], turn=1.0),
            axis_through(W, [1, 0, 0], slide=0.4),
            axis_through(W + np.array([0, 0, wrist_miss]), [0, 1, 0], slide=0.1, turn=0.3),
            axis_through(W + np.array([0.088, 0, 0]), [0, 0, 1], slide=-0.3, turn=0.7),
        ),
        S,
        W,
    )


def test_origins_of_a_spherical_shoulder_arm_are_moved_to_where_its_axes_meet():
    axes, S, W = spherical_shoulder_arm()
    _, p_AL = link_frames(axes)
    # A few roundings of numbers below 1.
    np.testing.assert_allclose(p_AL[[0, 1, 2]], [S, S, S], atol=1e-15)
    np.testing.assert_allclose(p_AL[[4, 5]], [W, W], atol=1e-15)
    np.testing.assert_array_equal(p_AL[[3, 6]], [axes[3].p_AJ, axes[6].p_AJ])


@pytest.mark.parametrize("miss", [{"shoulder_miss": 0.01}, {"wrist_miss": 0.01}], ids=str)
def test_a_spherical_shoulder_alone_leaves_axis_1_and_the_wrist_alone(miss):
    # Axes 2 and 3 meet here or not; nothing else may move for it.
    axes, _, _ = spherical_shoulder_arm(**miss)
    _, p_AL = link_frames(axes)
    for i in (0, 3, 4, 5, 6):
        np.testing.assert_array_equal(p_AL[i], axes[i].p_AJ)


def test_an_arm_of_both_classes_keeps_its_first_joint_frame():
    # With a spherical wrist the chain is not reversed, so axis 1 needs no special frame.
    axes, S, W = spherical_shoulder_arm()
    axes = (*axes[:6], axis_through(W, [0, 0, 1], slide=-0.3, turn=0.7))
    _, p_AL = link_frames(axes)
    np.testing.assert_array_equal(p_AL[0], axes[0].p_AJ)
    np.testing.assert_allclose(p_AL[[1, 2]], [S, S], atol=1e-15)
    np.testing.assert_allclose(p_AL[[4, 5, 6]], [W, W, W], atol=1e-15)
