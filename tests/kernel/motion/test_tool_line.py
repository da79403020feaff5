"""Motion of shapes seen from a tool that moves straight: the bounds hold, and are close."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from tcs.kernel.motion.contact_bounds import place_shape, take_posture
from tcs.kernel.motion.edges import take_middle
from tcs.kernel.motion.scene import SEEN_FROM_TOOL
from tcs.kernel.motion.separating_planes import take_twists
from tcs.kernel.motion.straight import (
    LIMITS,
    OFF_LINE,
    new_straight_workspace,
    straight_motion,
    take_pieces,
)
from tcs.kernel.motion.tool_line import take_line
from tcs.kernel.views import unowned
from tests.chosen import some_of
from tests.kernel.arms import drake_arm
from tests.kernel.motion.test_separating_planes import corners
from tests.kernel.motion.toys import bare, prepared, within_limits
from tests.reference.kinematics import link_poses

FASTEST = np.full(7, np.inf)
LENGTH = 0.1
"""Length of the lines [m]."""


@numba.njit(error_model="numpy")
def place(owned_scene, owned_work, offset, points, tangents, errors, begin, end):
    """Place the shapes of the arm in the middle of a part of a spline along a line."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    take_pieces(work, points, tangents, 0, len(points) - 1)
    take_line(scene, work, offset, points, tangents, tangents, errors[0], errors[1])
    take_middle(work, begin, end)
    take_posture(scene, work)
    take_twists(scene, work, 0.5 * (end - begin))
    for i in range(len(scene.shapes.links)):
        place_shape(scene, work, i)


def errors_at_middles(chain, spline, offset, pieces):
    """Return the greatest distance and rotation of the tool from the line amid the pieces."""
    R0, p0 = link_poses(chain, spline(0.0))[-1]
    off = turned = 0.0
    for s in (np.arange(pieces) + 0.5) / pieces:
        R, p = link_poses(chain, spline(s))[-1]
        off = max(off, np.linalg.norm(p - p0 - s * offset))
        turned = max(turned, Rotation.from_matrix(R0.T @ R).magnitude())
    return np.array([off, turned])


@pytest.mark.parametrize("pieces", some_of([2, 4], 2))
def test_shapes_stay_where_line_and_tool_lead_them(rng, pieces):
    chain = drake_arm("pr2 left").chain
    scene, work, _ = prepared(bare(chain))
    count, wider, beyond, lines = len(scene.shapes.links), [], 0, 0
    for _ in range(400):
        q, offset = within_limits(rng, chain), rng.normal(size=3)
        offset *= LENGTH / np.linalg.norm(offset)
        points, tangents = np.empty((2, pieces + 1, 7))
        line = new_straight_workspace()
        work.piece.line[3] = np.inf
        if straight_motion(scene, work, line, q, offset, FASTEST, points, tangents) == LIMITS:
            continue
        spline = CubicHermiteSpline(np.linspace(0.0, 1.0, pieces + 1), points, tangents)
        errors = errors_at_middles(chain, spline, offset, pieces)
        if errors.max() > OFF_LINE:
            continue
        lines += 1
        take = (scene, work, offset, points, tangents, errors)
        place(*take, 0.0, 1.0)
        seen = work.piece.by_tool[:count].copy()
        assert not seen[scene.shapes.link_frame < SEEN_FROM_TOOL].any()
        frame = scene.shapes.link_frame[seen]
        rest, motion = work.piece.rest[:count, 0][seen], work.piece.motion[:count, 0][seen]
        middle, w, v = (
            corners(work.posture.shapes[:count])[seen],
            work.piece.tool_twist[frame, :3],
            work.piece.tool_twist[frame, 3:],
        )
        to_first_order = np.cross(w[:, None], middle) + v[:, None]
        for t in np.linspace(-1.0, 1.0, 21):
            at = 0.5 * (1.0 + t)
            place(*take, at, at)
            moved = corners(work.posture.shapes[:count])[seen] - middle
            away = np.linalg.norm(moved - t * to_first_order, axis=2).max(axis=1, initial=0.0)
            assert np.all(away <= rest)
            assert np.all(np.linalg.norm(moved, axis=2).max(axis=1, initial=0.0) <= motion)
            # The gripper leaves the line by no more than the errors, which are not nothing.
            beyond += np.count_nonzero(away[frame == 7] > 1e-5)
        work.piece.line[3] = np.inf
        place_without_line(scene, work)
        wider.append(work.piece.rest[:count, 0][seen] / rest)
    assert lines > 20
    assert beyond > 20
    # By the joints between the shapes and the base, the bound is several times as wide.
    assert np.median(np.concatenate(wider)) > 3.0


@numba.njit(error_model="numpy")
def place_without_line(owned_scene, owned_work):
    """Place the shapes of the arm in the middle of the current curve, on which there is no line."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    take_middle(work, 0.0, 1.0)
    take_posture(scene, work)
    take_twists(scene, work, 0.5)
    for i in range(len(scene.shapes.links)):
        place_shape(scene, work, i)
