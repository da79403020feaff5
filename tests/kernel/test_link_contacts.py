"""Contacts of groups of the arm: the first pair of shapes that touches, whatever the clusters."""

import numpy as np
import pytest

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.kernel.cache import jit
from tcs.kernel.collide import TYPE, closer
from tcs.kernel.contacts import ARM, BODY, ENVIRONMENT
from tcs.kernel.kinematics import link_poses
from tcs.kernel.link_contacts import arm_touches, body_touches, environment_touches
from tcs.kernel.problem import build_problem
from tcs.kernel.workspace import new_workspace, place_group, place_link
from tests.chosen import some_of
from tests.kernel.judge import chain_of
from tests.kernel.toy import crowded, toy_scene
from tests.reference.constructed import random_posture

NONE = -1


@jit
def place_environment(problem, work, q):
    """Place the groups of the arm at joint angles q; the environment stands as it does in W."""
    link_poses(problem.chain.R, problem.chain.p, q, work.link_R, work.link_p)
    work.environment_A[:] = problem.environment.shapes[0]


@jit
def first_pair(problem, work, body_A, partner, g, h, found):
    """Fill the rows of the pair that is named for group g of the arm and part h of a partner.

    A part is a shape of the environment, or a group.
    """
    place_group(problem, work, g)
    if partner == ENVIRONMENT:
        touches = environment_touches(problem, work, g, work.environment_A, h)
    elif partner == BODY:
        touches = body_touches(problem, work, body_A, g, h)
    else:
        place_group(problem, work, h)
        touches = arm_touches(problem, work, g, h)
    if touches:
        found[:] = work.touching


@jit
def first_of_all(problem, work, a, b, gaps, g, parts, found):
    """Fill the first rows of group g of the arm, in `a`, and of `parts` in b that touch."""
    first = problem.links.groups.first
    found[:] = NONE
    for i in range(first[g], first[g + 1]):
        for j in range(parts[0], parts[1]):
            if gaps[i, j] > 0.0 and closer(a, i, b, j, gaps[i, j]):
                found[0], found[1] = i, j
                return


@jit
def place_all(problem, work):
    """Place every row of the arm."""
    for i in range(len(problem.links.shapes)):
        place_link(problem, work, i)


@pytest.mark.parametrize("seed", some_of(range(2), 0))
def test_pair_is_the_first_that_touches(lowered, seed):
    chain, rng = chain_of(seed, lowered), np.random.default_rng(seed)
    # Shapes of one kind only would leave a case of `_seen_from` out.
    scene = crowded(toy_scene(chain, seed, obstacles=12), rng, 30)
    problem = build_problem(scene)
    assert set(problem.environment.shapes[0, :, TYPE]) == {SPHERE, CAPSULE, BOX}
    of_arm, of_body = problem.links.groups.first, problem.body.groups.first
    every = np.arange(problem.environment.shapes.shape[1] + 1)
    work, whole = new_workspace(problem), new_workspace(problem)
    body = problem.body.shapes_A[0]
    partners = (
        (ENVIRONMENT, problem.environment.shapes[0], problem.clearances.environment, every),
        (BODY, body, problem.clearances.body, of_body),
        (ARM, whole.arm, problem.clearances.arm, of_arm),
    )
    found, right = np.empty(2, np.int64), np.empty(2, np.int64)
    counts = np.zeros((3, 2), int)
    for _ in range(80):
        q = random_posture(rng, chain)
        place_environment(problem, work, q)
        place_environment(problem, whole, q)
        place_all(problem, whole)
        for g in range(len(of_arm) - 1):
            for partner, b, gaps, first in partners:
                for h in range(g if partner == ARM else len(first) - 1):
                    other = h if partner == ENVIRONMENT else first[-1] + h
                    found[:] = NONE
                    if gaps[of_arm[-1] + g, other] > 0.0:
                        first_pair(problem, work, body, partner, g, h, found)
                    first_of_all(problem, whole, whole.arm, b, gaps, g, first[h : h + 2], right)
                    np.testing.assert_array_equal(found, right)
                    counts[partner, int(found[0] != NONE)] += 1
    assert np.all(counts > 10), counts
