"""Motions of arms of five and six joints, prismatic and coupled ones among them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.kernel.motion.edges import NO_PAIR, certified, posture_contact
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.motion.scene import FRAMES, motion_scene, new_motion_workspace
from tcs.kernel.motion.straight import DONE, OFF_LINE, new_straight_workspace, straight_motion
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tests.kernel.motion.test_separating_planes import judge
from tests.kernel.motion.toys import HERE, prepared, within_limits
from tests.kernel.test_five_joints import AXIS, TURN, five_joint_chain
from tests.kernel.test_sliding_arms import ORDERS, sliding_chain
from tests.kernel.toy import toy_grid, toy_scene
from tests.reference.kinematics import link_poses
from tests.reference.motion import is_free_along, least_excess, straight_curve

COUPLED = (0.5, 0.25)
"""Fractions of the motion of the second prismatic joint that links behind it make."""


def driving_chain(name):
    """Return an arm of three prismatic joints of some decimetres, the second one of four parts."""
    chain, order = sliding_chain(ORDERS[name], 3), list(ORDERS[name])
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[order], upper[order] = [-0.3, 0.0, -0.2], [0.3, 0.13, 0.4]
    coupled = np.array([(order[1], part) for part in COUPLED])
    return chain._replace(lower=lower, upper=upper, coupled=coupled)


def driving_scene(name, seed=0, obstacles=20):
    """Return a random scene of `driving_chain`, two of its shapes on the coupled links."""
    chain = driving_chain(name)
    scene = toy_scene(chain, seed, obstacles=obstacles)
    frame = np.array([ORDERS[name][0] + 1, FRAMES, FRAMES + 1, ORDERS[name][1] + 1, 7, 7], np.int8)
    own = frame[:, None] != frame
    own[-2:, -2:] = False
    p = scene.arm.p.copy()
    p[0, :3] = [[0.0, -0.4, 0.0], [0.0, 0.2, 0.05], [0.1, 0.0, 0.0]]
    return chain, scene._replace(arm=scene.arm._replace(frame=frame, p=p), arm_vs_arm=own)


def drawn(rng, chain):
    q = within_limits(rng, chain)
    q[: 7 - chain.joints] = 0.0
    return q


@pytest.mark.parametrize("name", ORDERS)
def test_postures_and_certified_curves_are_free_by_the_reference(name, rng):
    chain, scene = driving_scene(name)
    ready, work, plain = prepared(scene)
    assert {0, FRAMES, FRAMES + 1} <= set(ready.pairs.members[:, 2])
    found, free = [], 0
    for _ in range(60):
        q = drawn(rng, chain)
        excess = least_excess(plain, q)
        found.append(posture_contact(ready, work, q) == NO_PAIR)
        if abs(excess) > 1e-9:
            assert found[-1] == (excess > 0.0), excess
        if found[-1]:
            control = straight_curve(q, q + 0.15 * (drawn(rng, chain) - q))
            control[1:3] += 0.02 * (rng.normal(size=(2, 7)) * (np.arange(7) > 0))
            if certified(ready, work, control) == 1.0:
                free += 1
                assert is_free_along(
                    control, 100, lambda at: posture_contact(ready, work, at) != NO_PAIR
                )
    assert 5 < sum(found) < 55
    assert free > 2


@pytest.mark.parametrize("name", ORDERS)
def test_shapes_with_a_plane_between_them_do_not_meet(name, rng):
    chain, scene = driving_scene(name, obstacles=40)
    # Every pair counts here, those that never touch too.
    ready = motion_scene(build_problem(scene), rows_at(toy_grid(), [HERE]))
    work = new_motion_workspace(ready)
    plane, meets = np.zeros((2, len(ready.pairs.members)), np.bool_)
    counts = np.zeros((2, 2), np.int64)
    for _ in range(60):
        q = drawn(rng, chain)
        control = straight_curve(q, q + 0.3 * (drawn(rng, chain) - q))
        control[1:3] += 0.05 * (rng.normal(size=(2, 7)) * (np.arange(7) > 0))
        meets[:] = False
        judge(ready, work, control, plane, meets)
        assert not np.any(plane & meets)
        between = ready.pairs.members[:, 2] >= FRAMES
        for n, which in enumerate((between, ~between)):
            counts[n] += np.count_nonzero(plane[which]), np.count_nonzero(meets[which])
    assert np.all(counts > 20)


@pytest.mark.parametrize("name", [*ORDERS, "five joints"])
def test_the_tool_stays_on_a_line_from_any_of_its_postures(name, rng):
    chain = five_joint_chain(8) if name == "five joints" else driving_chain(name)
    scene = toy_scene(chain, 0, obstacles=0)
    if name == "five joints":
        scene = scene._replace(freedom=np.repeat(TURN.row()[None], 5, axis=0))
    ready, work, _ = prepared(scene._replace(arm_vs_environment=np.zeros((6, 1), bool)))
    problem, done = build_problem(scene), 0
    axis = ready.chain.free_axis if chain.joints == 5 else None
    for _ in range(100):
        R0, p0 = link_poses(chain, drawn(rng, chain))[-1]
        for q in postures_at(problem, R0, p0, 0, may_turn=True):
            R, p = link_poses(chain, q)[-1]
            np.testing.assert_allclose(p, p0, atol=1e-6)
            np.testing.assert_allclose(
                *((R, R0) if axis is None else (R @ axis, R0 @ axis)), 0, 1e-6
            )
            offset = rng.normal(size=3)
            offset *= 0.03 / np.linalg.norm(offset)
            points, tangents = np.empty((2, 7, 7))
            line, fastest = new_straight_workspace(), np.full(7, np.inf)
            if straight_motion(ready, work, line, q, offset, fastest, points, tangents) != DONE:
                continue
            done += 1
            assert not np.any(points[:, : 7 - chain.joints])
            spline = CubicHermiteSpline(np.linspace(0, 1, 7), points, tangents)
            for s in np.linspace(0, 1, 25):
                S, at = link_poses(chain, spline(s))[-1]
                np.testing.assert_allclose(at, p + s * offset, atol=2 * OFF_LINE)
                turned = S - R if axis is None else (S - R) @ axis
                np.testing.assert_allclose(turned, 0.0, atol=2 * OFF_LINE)
    assert done > 5


def test_an_arm_of_five_joints_turns_its_tool_on_the_way():
    """Its free rotation takes up what its joints cannot keep."""
    assert np.any(np.cross(AXIS, [0.0, 0.0, 1.0]))
    chain = five_joint_chain(8)
    scene = toy_scene(chain, 0, obstacles=0)._replace(
        freedom=np.repeat(TURN.row()[None], 5, axis=0),
        arm_vs_environment=np.zeros((6, 1), bool),
    )
    ready, work, _ = prepared(scene)
    rng, turned = np.random.default_rng(0), []
    for _ in range(50):
        points, tangents = np.empty((2, 7, 7))
        line, fastest = new_straight_workspace(), np.full(7, np.inf)
        q, offset = drawn(rng, chain), np.array([0.0, 0.03, 0.0])
        if straight_motion(ready, work, line, q, offset, fastest, points, tangents) == DONE:
            R, S = (link_poses(chain, at)[-1][0] for at in points[[0, -1]])
            turned.append(np.abs(R - S).max())
    assert max(turned) > 0.02
