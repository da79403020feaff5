"""Planes between shapes: where there is one, the shapes do not meet anywhere on the piece."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from tcs.kernel.motion.edges import take_middle
from tcs.kernel.motion.pairs import is_near, place_shape, take_posture
from tcs.kernel.motion.planes import plane_between, take_twists
from tcs.kernel.views import unowned
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import toy, within_limits

SAMPLES = 60


@numba.njit(error_model="numpy")
def judge(owned_scene, owned_work, control, plane, meets):
    """Fill between which pairs a plane is on a whole curve, and which are near at samples of it."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.control[: len(control)] = control
    work.pieces[0] = len(control) // 3
    take_middle(work, 0.0, 1.0)
    take_posture(scene, work)
    take_twists(work)
    for k in range(len(scene.pair)):
        i, j, base = scene.pair[k]
        place_shape(scene, work, i)
        if base > 0:
            place_shape(scene, work, j)
        plane[k] = plane_between(scene, work, i, j, base, scene.gap[k])
    for n in range(SAMPLES + 1):
        t = n / SAMPLES
        take_middle(work, t, t)
        take_posture(scene, work)
        for k in range(len(scene.pair)):
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
        plane, meets = np.zeros((2, len(scene.pair)), np.bool_)
        for _ in range(80):
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
    assert planes > 1000
    assert tight > 100
