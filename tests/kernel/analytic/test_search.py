"""Angles at which the kernel searches for solutions, compared with those of the reference."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.arcs import elbow_arcs
from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.scratch import new_search
from tcs.kernel.analytic.search import find_candidates
from tcs.kernel.analytic.solver import arm_solver
from tests.kernel.judge import chain_of
from tests.kernel.toy import goal_in_base, size_of, toy_grid, toy_scene
from tests.reference import candidates as reference_candidates
from tests.reference.kinematics import free_joint

# Seed of arm and environment, configuration, goal. Rounding decides how many samples an arc gets
# (103, 151), whether its outermost sample is feasible (119), whether two arcs are one (the rest).
TIES = [(103, 6, 4), (151, 45, 1), (119, 131, 3), (69, 124, 4), (127, 8, 4), (213, 32, 1)]


def angles_of_both(chain, X_AG):
    """Return the feasible angles that kernel and reference find, in order."""
    arm, search = arm_solver(chain), new_search()
    wrist_goal(arm, X_AG[0], X_AG[1], search.goal)
    count, _ = elbow_arcs(arm, search.goal, search.feasible.arcs)
    found = find_candidates(arm, search, count)
    arcs, _ = reference_candidates.elbow_arcs(chain, X_AG)
    expected = reference_candidates.find_candidates(chain, X_AG, arcs)
    free = free_joint(chain)
    assert count == len(arcs)
    return np.sort(search.candidates.angle[:found]), np.sort(
        [candidate.q[free] for candidate in expected]
    )


@pytest.mark.parametrize(("seed", "h", "g"), TIES, ids=str)
def test_ties_are_not_left_to_rounding(lowered, seed, h, g):
    chain = chain_of(seed, lowered)
    scene = toy_scene(chain, seed, obstacles=seed % 14)
    kernel, expected = angles_of_both(chain, goal_in_base(scene, toy_grid(), h, g))
    # Ends of arcs as arc cosines, 1e-16 becomes 1e-8 in its angle where the cosine is flat.
    np.testing.assert_allclose(kernel, expected, atol=1e-7)


@pytest.mark.parametrize(
    "spherical_shoulder", [False, True], ids=["spherical-wrist", "spherical-shoulder"]
)
@pytest.mark.parametrize("seed", range(1, 41, 2))
def test_the_kernel_samples_where_the_reference_samples(lowered, seed, spherical_shoulder):
    rng = np.random.default_rng(seed)
    chain = chain_of(seed, lowered, spherical_shoulder=spherical_shoulder)
    scene, grid = toy_scene(chain, seed, obstacles=0), toy_grid()
    for h, g in zip(rng.integers(size_of(grid), size=3), rng.integers(5, size=3), strict=True):
        kernel, expected = angles_of_both(chain, goal_in_base(scene, grid, h, g))
        np.testing.assert_allclose(kernel, expected, atol=1e-7)
