"""Poses of the links by the vector loop over the sines of all joints, beside those of scoring."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.cache import jit
from tcs.kernel.kinematics import link_poses
from tcs.kernel.motion.link_poses import LANES, place_links
from tests.kernel.arms import drake_arm


@jit
def by_library(chain_R, chain_p, q, link_R, link_p):
    link_poses(chain_R, chain_p, q, link_R, link_p)


@jit
def by_vector(chain_R, chain_p, q, turns, link_R, link_p):
    place_links(chain_R, chain_p, q, turns, link_R, link_p)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 7.0, 6000.0])
def test_poses_are_those_of_the_library(rng, scale):
    chain = drake_arm("pr2 left").chain
    R, p, turns = np.empty((2, 8, 3, 3)), np.empty((2, 8, 3)), np.zeros((3, LANES))
    # Multiples of an eighth of a turn are where quarters change.
    eighths = np.pi / 4.0 * rng.integers(-8, 9, (40, 7))
    for q in [*rng.uniform(-scale, scale, (200, 7)), *eighths]:
        by_library(chain.R, chain.p, q, R[0], p[0])
        by_vector(chain.R, chain.p, q, turns, R[1], p[1])
        # Sines differ by one last bit, 1.1e-16; seven rotations add up.
        np.testing.assert_allclose(turns[1, :7], np.sin(q), rtol=0, atol=2.3e-16)
        np.testing.assert_allclose(turns[2, :7], np.cos(q), rtol=0, atol=2.3e-16)
        np.testing.assert_allclose(R[1], R[0], rtol=0, atol=1e-14)
        np.testing.assert_allclose(p[1], p[0], rtol=0, atol=1e-14)
