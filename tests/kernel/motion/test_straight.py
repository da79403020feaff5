"""Straight motions of the tool, and postures that hold it at a pose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.kernel.arrays import BOX
from tcs.kernel.collide import SIZE
from tcs.kernel.motion.edges import NO_PAIR, posture_contact
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.motion.straight import (
    BLOCKED,
    DONE,
    LIMITS,
    OFF_LINE,
    new_straight_workspace,
    straight_motion,
)
from tcs.kernel.problem import build_problem
from tests.kernel.arms import drake_arm
from tests.kernel.motion.toys import HERE, SWING, bare, prepared, within_limits
from tests.kernel.shapes import placed
from tests.kernel.toy import toy_grid, with_obstacle
from tests.reference.constructed import arm_base
from tests.reference.kinematics import link_poses

UNLIMITED = np.full(7, np.inf)


@pytest.fixture(scope="module")
def chain():
    return drake_arm("pr2 left").chain


def follow(ready, work, q, offset, *, pieces=20, fastest=UNLIMITED, before=np.nan):
    """Return outcome, points and tangents of a straight motion, filled with `before` before it."""
    points, tangents = np.full((pieces + 1, 7), before), np.full((pieces + 1, 7), before)
    line = new_straight_workspace()
    outcome = straight_motion(ready, work, line, q, offset, fastest, points, tangents)
    return outcome, points, tangents


def test_the_tool_stays_on_the_line_between_the_points_too(chain, rng):
    ready, work, _ = prepared(bare(chain))
    done = 0
    for _ in range(40):
        q = within_limits(rng, chain)
        if posture_contact(ready, work, q) != NO_PAIR:
            continue
        direction = rng.normal(size=3)
        offset = 0.1 * direction / np.linalg.norm(direction)
        outcome, points, tangents = follow(ready, work, q, offset)
        if outcome != DONE:
            continue
        done += 1
        R0, p0 = link_poses(chain, q)[-1]
        spline = CubicHermiteSpline(np.linspace(0, 1, 21), points, tangents)
        for s in np.linspace(0, 1, 77):
            R, p = link_poses(chain, spline(s))[-1]
            np.testing.assert_allclose(p, p0 + s * offset, atol=2 * OFF_LINE)
            np.testing.assert_allclose(R, R0, atol=2 * OFF_LINE)
            assert np.all(
                (spline(s) > ready.limits.lower - 1e-9) & (spline(s) < ready.limits.upper + 1e-9)
            )
    assert done > 5


def test_a_joint_rests_at_its_limit_whatever_was_in_memory_before(chain, rng):
    ready, work, _ = prepared(bare(chain))
    resting = 0
    for _ in range(200):
        q = within_limits(rng, chain)
        joint = rng.choice(np.flatnonzero(np.isfinite(chain.upper)))
        q[joint] = chain.upper[joint] - 1e-3
        if posture_contact(ready, work, q) != NO_PAIR:
            continue
        offset = rng.normal(size=3)
        offset *= 0.05 / np.linalg.norm(offset)
        outcomes = [follow(ready, work, q, offset, before=value) for value in (np.nan, 0.0, 1.0)]
        assert len({outcome for outcome, *_ in outcomes}) == 1
        if outcomes[0][0] == DONE:
            points = outcomes[0][1]
            assert all(np.array_equal(points, other) for _, other, _ in outcomes[1:])
            resting += int(np.sum(points[:, joint] == chain.upper[joint]) > 3)
    assert resting > 3


def test_a_plate_blocks_the_line_and_is_named(chain):
    scene = bare(chain)
    R_WA, p_WA = arm_base(scene, toy_grid(), HERE)
    q = np.array([0.6, 0.0, 0.0, -1.2, 0.0, -0.3, 0.0])
    R, p = link_poses(chain, q)[-1]
    ahead = 0.1 * R[:, 0]
    free, scratch, _ = prepared(scene)
    assert follow(free, scratch, q, ahead)[0] == DONE
    plate = placed(BOX, [0.0005, 0.1, 0.1], R_WA @ R, R_WA @ (p + 0.8 * ahead) + p_WA)
    ready, work, _ = prepared(with_obstacle(scene, plate))
    assert posture_contact(ready, work, q) == NO_PAIR
    assert follow(ready, work, q, ahead)[0] == BLOCKED
    arm, other, carrier = ready.pairs.members[work.contacts.pair[0]]
    assert ready.shapes.link_frame[arm] == 7
    assert carrier == 0
    assert ready.shapes.fixed[other - len(ready.shapes.links), SIZE] == 0.0005


def test_joint_limits_and_velocity_limits_end_a_line(chain):
    ready, work, _ = prepared(bare(chain))
    q = SWING[0]
    R = link_poses(chain, q)[-1][0]
    # The arm is not a metre longer.
    assert follow(ready, work, q, 1.0 * R[:, 0])[0] == LIMITS
    outcome, points, tangents = follow(ready, work, q, -0.1 * R[:, 0])
    assert outcome == DONE
    fastest = np.abs(tangents).max(axis=0)
    assert follow(ready, work, q, -0.1 * R[:, 0], fastest=fastest * 1.001)[0] == DONE
    assert follow(ready, work, q, -0.1 * R[:, 0], fastest=fastest * 0.999)[0] == LIMITS
    assert np.abs(np.diff(points, axis=0)).max() < 0.1


@pytest.mark.parametrize("name", ["pr2 left", "panda", "baxter"])
def test_postures_hold_the_tool_at_the_pose(name, rng):
    chain = drake_arm(name).chain
    problem = build_problem(bare(chain))
    q = within_limits(rng, chain)
    R, p = link_poses(chain, q)[-1]
    found = postures_at(problem, R, p, 64)
    assert len(found) > 3
    assert np.all((found >= chain.lower) & (found <= chain.upper))
    for posture in found:
        R_AT, p_AT = link_poses(chain, posture)[-1]
        np.testing.assert_allclose(R_AT, R, atol=1e-6)
        np.testing.assert_allclose(p_AT, p, atol=1e-6)


def test_out_of_reach_there_is_no_posture(chain):
    problem = build_problem(bare(chain))
    assert len(postures_at(problem, np.eye(3), np.array([5.0, 0.0, 0.0]), 64)) == 0
