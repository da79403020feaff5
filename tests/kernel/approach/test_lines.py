"""Lines of the shortest joint motion, where limits end that: other rates, joints that rest."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.kernel.approach.sweep import ApproachLines, approach_spline
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tests.kernel.arms import drake_arm
from tests.kernel.toy import goal_in_base, scores_of, toy_grid, toy_scene
from tests.reference.kinematics import link_poses

GRID = toy_grid(states=1)
BACK = np.array([-0.1, 0.0, 0.0])
"""From the goal to the begin of the approach, in the tool frame [m]."""
ENDLESS = np.full(7, np.inf)
WIDE = np.full(7, 9.0)
"""Limits beyond all motions [rad]."""
ROOM = 0.02
"""Distance of other limits from a line [rad]."""
FEW = slice(0, 6)


@cache
def scene():
    """Return a scene of an arm without a closed form: through a posture leads a single line."""
    return toy_scene(drake_arm("baxter").chain, 0, obstacles=0, states=1)


@cache
def postures():
    """Return reached postures at goals: configuration, goal, joints."""
    scores = scores_of(scene(), GRID)
    pairs = np.argwhere(scores.reason == REACHED)[FEW]
    return [(int(h), int(g), scores.joints[h, g].astype(float)) for h, g in pairs]


def led(h, g, q, *, lower=-WIDE, upper=WIDE, fastest=ENDLESS):
    """Return the line through a posture within given limits, from the goal on; None without one."""
    limited = scene()._replace(chain=scene().chain._replace(lower=lower, upper=upper))
    goals = limited.goal_p.shape[1]
    lines = ApproachLines(np.tile(-BACK, (goals, 1)), np.tile(fastest, (goals, 1)))
    spline = approach_spline(build_problem(limited), lines, rows_at(GRID, [h]), g, q)
    return spline if spline is None else (spline[0][::-1], -spline[1][::-1])


def assert_on_line(h, g, spline):
    R_AG, p_AG = goal_in_base(scene(), GRID, h, g)
    curve = CubicHermiteSpline(np.linspace(0.0, 1.0, len(spline[0])), *spline)
    for fraction in np.linspace(0.0, 1.0, 30):
        R, p = link_poses(scene().chain, curve(fraction))[-1]
        assert np.abs(p - p_AG - fraction * (R_AG @ BACK)).max() < 1e-3
        assert np.abs(R - R_AG).max() < 1e-3


def test_a_joint_that_would_be_too_fast_moves_at_its_velocity_limit():
    found = 0
    for h, g, q in postures():
        shortest = led(h, g, q)
        if shortest is None:
            continue
        rates = np.abs(shortest[1]).max(axis=0)
        fastest, k = ENDLESS.copy(), int(np.argmax(rates))
        fastest[k] = 0.97 * rates[k]
        slower = led(h, g, q, fastest=fastest)
        if slower is None:
            continue
        assert np.abs(slower[1][:, k]).max() <= fastest[k]
        assert_on_line(h, g, slower)
        found += 1
    assert found >= 2


@pytest.mark.parametrize("side", [-1, 1], ids=["lower", "upper"])
def test_a_joint_that_is_at_its_limit_at_the_goal_may_rest_there(side):
    found = 0
    for h, g, q in postures():
        for k in (1, 3, 5):
            low, high = -WIDE, WIDE.copy()
            at_rest = led(h, g, q, lower=np.where(np.arange(7) == k, q, low),
                          upper=np.where(np.arange(7) == k, q, high))  # fmt: skip
            if at_rest is None:
                continue
            # Other limits leave room for that line alone; the joint itself may leave the limit.
            lower, upper = at_rest[0].min(axis=0) - ROOM, at_rest[0].max(axis=0) + ROOM
            lower[k], upper[k] = (q[k], q[k] + 0.2) if side < 0 else (q[k] - 0.2, q[k])
            again = led(h, g, q, lower=lower, upper=upper)
            assert again is not None
            assert_on_line(h, g, again)
            found += 1
    assert found > 5
