"""A small arm among a few shapes, prepared for motions, compiled and in plain loops."""

from __future__ import annotations

import numpy as np

from tcs.kernel.motion.never_in_contact import with_needed_pairs
from tcs.kernel.motion.scene import motion_scene, new_motion_workspace
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tests.kernel.toy import toy_grid, toy_scene
from tests.reference.pairs import placed_scene

HERE = 40
"""A configuration in the middle of the grid, on the lower torso level."""

SWING = np.array([[0.9, 0.0, 0.0, -0.5, 0.0, -0.3, 0.0], [-0.7, 0.0, 0.0, -0.5, 0.0, -0.3, 0.0]])
"""Two postures of the PR2's arm, ahead to the left and to the right [rad]."""


def prepared(scene, h=HERE):
    """Return a motion scene, its workspace and the scene as the reference reads it."""
    ready = with_needed_pairs(motion_scene(build_problem(scene), rows_at(toy_grid(), [h])))
    return ready, new_motion_workspace(ready), placed_scene(scene, toy_grid(), h, 0)[0]


def toy(chain, seed=0, obstacles=6):
    """Return `prepared` of a random scene."""
    return prepared(toy_scene(chain, seed, obstacles=obstacles))


def bare(chain):
    """Return the scene of an arm without an environment but the floor."""
    return toy_scene(chain, 0, obstacles=0)


def within_limits(rng, chain):
    """Return random joint angles within the limits [rad]."""
    low = np.where(np.isfinite(chain.lower), chain.lower, -np.pi)
    high = np.where(np.isfinite(chain.upper), chain.upper, np.pi)
    return rng.uniform(low, high)
