"""The scene of the approaches: one for all torso levels."""

from __future__ import annotations

import numpy as np

from tcs.kernel.approach.scene import approach_scene
from tcs.kernel.collide import CENTRE
from tcs.kernel.motion.never_in_contact import needed_pairs
from tcs.kernel.motion.scene import torso_scene
from tcs.kernel.problem import build_problem
from tests.kernel.arms import drake_arm
from tests.kernel.toy import toy_scene
from tests.reference.kinematics import link_poses


def needed_at(problem, torso):
    """Return the pairs of the robot's own shapes that can touch at a torso level."""
    scene = torso_scene(problem, torso)
    own = scene.shapes.body[scene.pairs.members[:, 1]] >= problem.environment.bodies
    needed = needed_pairs(scene, own) & own
    return set(map(tuple, scene.pairs.members[needed, :2].tolist()))


def test_pairs_that_touch_at_another_torso_level_are_kept():
    chain = drake_arm("pr2 left").chain
    problem = build_problem(toy_scene(chain, 0))
    body = problem.body.shapes_A.copy()
    # At the first level everything around the arm is far away, at the second where link 2 is.
    body[0, :, CENTRE] += 9.0
    body[1, :, CENTRE : CENTRE + 3] = link_poses(chain, np.zeros(7))[1][1]
    # Two joints decide whether shapes of link 2 and fixed ones can touch.
    frame = np.where(problem.links.frame == 4, 2, problem.links.frame)
    problem = problem._replace(
        body=problem.body._replace(shapes_A=body), links=problem.links._replace(frame=frame)
    )
    first, second = needed_at(problem, 0), needed_at(problem, 1)
    assert second - first
    scene = approach_scene(problem).motion
    kept = set(map(tuple, scene.pairs.members[:, :2].tolist()))
    assert first | second <= kept
