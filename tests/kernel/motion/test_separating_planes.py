"""Planes between shapes: where there is one, the shapes do not meet anywhere on the piece."""

from __future__ import annotations

import itertools

import numba
import numpy as np
import pytest

from tcs.kernel.arrays import BOX, CAPSULE
from tcs.kernel.collide import CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.contact_bounds import is_near, place_shape, take_posture
from tcs.kernel.motion.edges import take_middle
from tcs.kernel.motion.separating_planes import plane_between, take_twists
from tcs.kernel.views import unowned
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import toy, within_limits

SAMPLES = 60


@numba.njit(error_model="numpy")
def judge(owned_scene, owned_work, control, plane, meets):
    """Fill between which pairs a plane is on a whole curve, and which are near at samples of it."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.curve.control[: len(control)] = control
    work.curve.pieces[0] = len(control) // 3
    take_middle(work, 0.0, 1.0)
    take_posture(scene, work)
    take_twists(scene, work, 0.5)
    for k in range(len(scene.pairs.members)):
        i, j, base = scene.pairs.members[k]
        place_shape(scene, work, i)
        if base > 0:
            place_shape(scene, work, j)
        plane[k] = plane_between(scene, work, i, j, base, scene.pairs.gap[k], np.inf, True)
    for n in range(SAMPLES + 1):
        t = n / SAMPLES
        take_middle(work, t, t)
        take_posture(scene, work)
        for k in range(len(scene.pairs.members)):
            meets[k] |= is_near(scene, work, k, False)


@pytest.mark.parametrize(
    ("pieces", "bent", "back"),
    [(1, 0.0, 0.0), (1, 0.1, 0.0), (4, 0.03, 0.0), (1, 0.0, 0.15), (4, 0.0, 0.15)],
    ids=["straight", "bent", "of four pieces", "out and back", "of four pieces, out and back"],
)
def test_shapes_with_a_plane_between_them_do_not_meet(rng, pieces, bent, back):
    chain = drake_arm("pr2 left").chain
    planes = tight = 0
    for seed in range(3):
        scene, work, _ = toy(chain, seed, obstacles=40)
        plane, meets = np.zeros((2, len(scene.pairs.members)), np.bool_)
        for _ in range(40):
            start = within_limits(rng, chain)
            step = rng.normal(size=7) * (back or 0.3)
            along = np.linspace(0.0, 1.0, 3 * pieces + 1)[:, None]
            if back:
                # The middle is where the curve turns: to first order, nothing moves.
                along = np.minimum(along, 1.0 - along)
            control = start + along * step
            control[1:-1] += bent * rng.normal(size=(3 * pieces - 1, 7))
            meets[:] = False
            judge(scene, work, control, plane, meets)
            assert not np.any(plane & meets)
            planes += np.count_nonzero(plane)
            tight += np.count_nonzero(meets)
    # Both verdicts are frequent, or the test would show nothing.
    assert planes > 500
    assert tight > 50


@numba.njit(error_model="numpy")
def distances(owned_scene, owned_work, q, distance):
    """Fill the distance of each pair at a posture, at most 0.3 m; the gaps of the scene change."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.posture.q[:], work.piece.delta[:] = q, 0.0
    take_posture(scene, work)
    for k in range(len(scene.pairs.members)):
        low, high = 0.0, 0.3
        for _ in range(40):
            scene.pairs.gap[k] = 0.5 * (low + high)
            near = is_near(scene, work, k, False)
            low, high = (low, scene.pairs.gap[k]) if near else (scene.pairs.gap[k], high)
        distance[k] = low


@numba.njit(error_model="numpy")
def keep(owned_scene, owned_work, control, gap, plane):
    """Fill between which pairs a plane keeps a gap on a whole curve."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.curve.pieces[0] = 1
    work.curve.control[: len(control)] = control
    take_middle(work, 0.0, 1.0)
    take_posture(scene, work)
    take_twists(scene, work, 0.5)
    for k in range(len(scene.pairs.members)):
        i, j, base = scene.pairs.members[k]
        place_shape(scene, work, i)
        if base > 0:
            place_shape(scene, work, j)
        plane[k] = plane_between(scene, work, i, j, base, gap[k], np.inf, True)


def test_motion_away_from_a_plane_does_not_count(rng):
    """Shapes that are nearest at one end of a short edge are certified down to nearly there."""
    chain = drake_arm("pr2 left").chain
    scene, work, _ = toy(chain, 0, obstacles=40)
    begin, end = np.empty((2, len(scene.pairs.members)))
    plane = np.zeros(len(scene.pairs.members), np.bool_)
    near = kept = 0
    for _ in range(150):
        start = within_limits(rng, chain)
        step = 0.01 * rng.normal(size=7)
        distances(scene, work, start, begin)
        distances(scene, work, start + step, end)
        least = np.minimum(begin, end)
        # Of second order in the step, and far below the motion of some millimetres.
        gap = np.maximum(least - 2e-4, 0.0)
        keep(scene, work, start + np.linspace(0.0, 1.0, 4)[:, None] * step, gap, plane)
        chosen = (least > 1e-3) & (np.maximum(begin, end) < 0.29) & (abs(end - begin) > 5e-4)
        near += np.count_nonzero(chosen)
        kept += np.count_nonzero(plane & chosen)
    assert near > 500
    # Near two corners no plane along a face or along two edges is as far away as the shapes.
    assert kept > 0.7 * near


@numba.njit(error_model="numpy")
def place(owned_scene, owned_work, control, t, half):
    """Place the shapes of the arm in the middle of a part of a curve."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.curve.pieces[0] = 1
    work.curve.control[: len(control)] = control
    take_middle(work, t - half, t + half)
    take_posture(scene, work)
    take_twists(scene, work, half)
    for i in range(len(scene.shapes.links)):
        place_shape(scene, work, i)


def corners(shapes):
    """Return the corners of boxes, and the centres of the caps of capsules, shape (n, 8, 3)."""
    half = shapes[:, SIZE : SIZE + 3].copy()
    along = np.where(shapes[:, TYPE] == CAPSULE, half[:, 1], 0.0)
    rounded = shapes[:, TYPE] != BOX
    half[rounded] = along[rounded, None] * [0.0, 0.0, 1.0]
    signs = np.array(list(itertools.product([-1.0, 1.0], repeat=3)))
    R = shapes[:, ROTATION:].reshape(-1, 3, 3)
    return shapes[:, None, CENTRE : CENTRE + 3] + np.einsum(
        "nij,cnj->nci", R, signs[:, None] * half
    )


def test_the_motion_of_a_shape_is_bounded_closely(rng):
    chain = drake_arm("pr2 left").chain
    scene, work, _ = toy(chain, 0)
    count, slack = len(scene.shapes.links), []
    for _ in range(60):
        start = within_limits(rng, chain)
        control = start + np.linspace(0.0, 1.0, 4)[:, None] * rng.normal(size=7) * 0.1
        control[1:3] += rng.normal(size=(2, 7)) * 0.01
        place(scene, work, control, 0.5, 0.5)
        bound, middle = work.piece.motion[:, 0].copy(), corners(work.posture.shapes[:count])
        moved = np.zeros(count)
        for t in np.linspace(0.0, 1.0, 21):
            place(scene, work, control, t, 0.0)
            away = np.linalg.norm(corners(work.posture.shapes[:count]) - middle, axis=2).max(axis=1)
            moved = np.maximum(moved, away)
        assert np.all(moved <= bound)
        slack.append(bound / moved)
    # It is 2.1, and 2.5 where the motions of the joints are only added up.
    assert np.median(slack) < 2.3
