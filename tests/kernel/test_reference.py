"""The plain-loop reference against Drake: poses, Jacobians, distances, inverse kinematics."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.verification import plain_dexterity
from tcs.model.scene.contacts import Group
from tests.kernel.shapes import around, random_arm, random_joints, rotation
from tests.reference import kinematics as reference
from tests.reference.kinematics import compose, inverse, link_poses, rot_z, shapes_of, solutions

# A dozen products of rotations over lengths of a few metres.
EXACT = 1e-12


def posed(scene, lowered, full_grid, rng):
    """Put Drake's scene at a random posture; return X_WA, the torso level and the joints."""
    levels = full_grid.axis("torso").values
    level = int(rng.integers(len(levels)))
    x, y, yaw = rng.uniform(-2, 2, 3)
    q = random_joints(rng, lowered.arrays.chain)
    scene.place_base(x, y, yaw)
    scene.set_torso(levels[level])
    scene.set_arm(q)
    X_WB = rot_z(yaw), np.array([x, y, 0.0])
    X_BA = lowered.arrays.arm_base_R[level], lowered.arrays.arm_base_p[level]
    return compose(X_WB, X_BA), X_WB, level, q


@pytest.mark.parametrize("seed", range(5))
def test_tool_pose_and_jacobian_are_drakes(scene, lowered, full_grid, seed):
    rng = np.random.default_rng(seed)
    chain = lowered.arrays.chain
    X_WA, _, _, q = posed(scene, lowered, full_grid, rng)
    R, p = compose(X_WA, link_poses(chain, q)[-1])
    X_WT = scene.tool_pose()
    np.testing.assert_allclose(R, X_WT.rotation().matrix(), atol=EXACT)
    np.testing.assert_allclose(p, X_WT.translation(), atol=EXACT)
    J = reference.jacobian(chain, q)
    J_W = np.vstack([X_WA[0] @ J[:3], X_WA[0] @ J[3:]])
    np.testing.assert_allclose(J_W, scene.tool_jacobian(), atol=EXACT)
    # A rotation of the frame does not change isotropy.
    drakes = plain_dexterity.isotropy(scene.tool_jacobian())
    assert plain_dexterity.isotropy(J) == pytest.approx(drakes, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_distances_of_the_real_shapes_are_drakes_or_less(scene, lowered, full_grid, seed):
    rng = np.random.default_rng(seed)
    arrays = lowered.arrays
    X_WA, X_WB, level, q = posed(scene, lowered, full_grid, rng)
    links = link_poses(arrays.chain, q)
    query = scene.query_object()
    parts = {group: [part for part in scene.built.parts if part.group is group] for group in Group}
    arm = [
        shape.moved(compose(X_WA, links[frame - 1]))
        for shape, frame in zip(shapes_of(arrays.arm, 0), arrays.arm.frame, strict=True)
    ]
    body = [shape.moved(X_WB) for shape in shapes_of(arrays.body, level)]
    environment = shapes_of(arrays.environment, 0)
    close = 0
    for _ in range(150):
        first, ours = [(Group.ARM, arm), (Group.BODY, body)][rng.integers(2)]
        second, theirs = [(Group.ENVIRONMENT, environment), (Group.BODY, body)][rng.integers(2)]
        i, j = int(rng.integers(len(ours))), int(rng.integers(len(theirs)))
        if (first, i) == (second, j):
            continue
        exact = reference.distance(ours[i], theirs[j])
        drakes = query.ComputeSignedDistancePairClosestPoints(
            parts[first][i].geometry, parts[second][j].geometry
        ).distance
        if exact <= 0 and drakes <= 1e-6:
            continue
        # Drake's iterations end too far out where edges are parallel (see test_collide).
        assert drakes > exact - 1e-6
        close += abs(drakes - exact) < 1e-5
    assert close > 60


@pytest.mark.parametrize("seed", range(20))
def test_solutions_reach_the_goal(seed):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng)
    for _ in range(10):
        q = random_joints(rng, chain)
        X_AG = link_poses(chain, q)[-1]
        found = solutions(chain, X_AG, q[0])
        nearest = min(found.values(), key=lambda s: np.max(np.abs(around(s.q - q))))
        # Where a branch ends, sqrt halves the digits.
        np.testing.assert_allclose(around(nearest.q - q), 0.0, atol=1e-6)
        for solution in found.values():
            if solution.slack > 1e-9:
                R, p = link_poses(chain, solution.q)[-1]
                np.testing.assert_allclose(R, X_AG[0], atol=1e-8)
                np.testing.assert_allclose(p, X_AG[1], atol=1e-8)
                assert np.all(solution.q >= chain.lower)
                assert np.all(solution.q <= chain.upper)


def test_poses_form_a_group(rng):
    X = rotation(rng), rng.normal(size=3)
    R, p = compose(X, inverse(X))
    # One product of rotations.
    np.testing.assert_allclose(R, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(p, 0.0, atol=1e-14)
