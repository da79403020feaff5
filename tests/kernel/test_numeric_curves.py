"""Numeric IK below the scene: bounds, the table of starts, Newton's method, curves."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.dexterity import INVERSE_CONDITION, ISOTROPY, LIMIT_WEIGHTED, MEASURES
from tcs.kernel.kinematics import SMALL_ANGLE_COSINE
from tcs.kernel.numeric.arm import CONTINUOUS_HALF_RANGE, WIDER, figures_at, numeric_arm
from tcs.kernel.numeric.curves import new_curves, point_between, slack_of, trace
from tcs.kernel.numeric.newton import (
    converge,
    evaluate,
    factorise,
    new_newton_workspace,
    null_space_direction,
    step_to_goal,
)
from tcs.kernel.numeric.search import is_within_span
from tcs.kernel.numeric.solutions import numeric_solutions
from tcs.kernel.verification import plain_dexterity
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import around, offset_arm, random_joints, straight_arm, turned_by
from tests.reference import kinematics as reference
from tests.reference.kinematics import link_poses


@pytest.fixture(params=["baxter", *range(5)], ids=str)
def chain(request):
    """Baxter's arm, and random arms none of whose axes meet."""
    if request.param == "baxter":
        return drake_arm("baxter").chain
    return offset_arm(np.random.default_rng(request.param))


def pose(chain, q):
    R, p = link_poses(chain, q)[-1]
    return np.ascontiguousarray(R), np.ascontiguousarray(p)


def test_no_posture_is_beyond_the_span(chain, rng):
    arm = numeric_arm(chain)
    assert all(is_within_span(arm, *pose(chain, random_joints(rng, chain))) for _ in range(2000))


def test_the_span_ends_where_a_straight_arm_does():
    # Pedestal 0.34, upper arm 0.42, forearm 0.4, hand 0.126 m; axes 1, 2, 3 and 5, 6, 7 meet. Joint
    # 4 is folded at zero and straight at half a turn.
    arm = numeric_arm(straight_arm(np.full(7, np.pi), 0.0))
    top = 0.34 + 0.42 + 0.4 + 0.126
    assert is_within_span(arm, np.eye(3), np.array([0.0, 0.0, top - 1e-6]))
    assert not is_within_span(arm, np.eye(3), np.array([0.0, 0.0, top + 1e-6]))


def test_limits_of_the_elbow_narrow_the_span():
    limits = np.full(7, 3.0)
    limits[3] = 0.5
    near, far = numeric_arm(straight_arm(limits, 0.0)).span
    # The law of cosines, folded and 0.5 rad from it.
    assert near == pytest.approx(0.02, abs=1e-6)
    assert far == pytest.approx(np.sqrt(0.42**2 + 0.4**2 - 2 * 0.42 * 0.4 * np.cos(0.5)), abs=1e-6)


def test_every_start_of_the_table_is_in_its_cell(chain, rng):
    arm = numeric_arm(chain)
    assert arm.first[0] == 0
    assert arm.first[-1] == len(arm.postures)
    assert np.all(np.diff(arm.first) >= 0)
    limited = arm.half < CONTINUOUS_HALF_RANGE
    off = np.abs(arm.postures - arm.middle[1:6])
    assert np.all(off <= np.where(limited, arm.half + WIDER, np.pi)[1:6] + 1e-12)
    X_0 = (chain.R[0], chain.p[0])
    for n in rng.choice(len(arm.postures), 200):
        q = np.array([0.0, *arm.postures[n], 0.3])
        R, p = reference.compose(reference.inverse(X_0), link_poses(chain, q)[6])
        figures = np.empty(4)
        point, axis = p + R[:, 2] * arm.ends[1], R[:, 2]
        azimuth = figures_at(*point, *axis, figures)
        assert around(azimuth - arm.azimuth[n]) == pytest.approx(0.0, abs=1e-12)
        index = np.floor(
            (figures - arm.cell[:, 0]) / arm.cell[:, 1] + 1e-9 * np.array([-1, 1, 1, 1])
        )
        index = np.clip(index.astype(int), 0, [13, 27, 7, 11])
        flat = np.ravel_multi_index(index, (14, 28, 8, 12))
        # A value on the face between two cells may round to either side.
        inside = arm.first[flat] <= n < arm.first[flat + 1]
        place = (figures - arm.cell[:, 0]) / arm.cell[:, 1]
        assert inside or np.any(np.abs(place - np.round(place)) < 1e-8)


def test_evaluation_fills_error_and_jacobian(chain, rng):
    arm, newton = numeric_arm(chain), new_newton_workspace()
    for _ in range(20):
        q = random_joints(rng, chain)
        R, p = pose(chain, q)
        # A dozen products of rotations over an arm of about 1 m.
        assert evaluate(arm, R, p, q, newton) < 1e-12
        np.testing.assert_allclose(newton.J, reference.jacobian(chain, q), atol=1e-12)
        to = pose(chain, q + rng.normal(scale=1e-4, size=7))
        evaluate(arm, *to, q, newton)
        np.testing.assert_allclose(newton.error[:3], turned_by(to[0] @ R.T), atol=1e-9)
        np.testing.assert_allclose(newton.error[3:], to[1] - p, atol=1e-12)


@pytest.mark.parametrize("angle", [0.01, 0.3, 1.0, 2.0, 3.0])
def test_a_large_rotation_is_given_by_its_angle(angle):
    chain = straight_arm(np.full(7, 3.0), 0.0)
    arm, newton = numeric_arm(chain), new_newton_workspace()
    R, p = pose(chain, np.zeros(7))
    evaluate(arm, R @ reference.rot_z(angle), p, np.zeros(7), newton)
    # A small one by its sine, which is all that Newton's method needs.
    value = angle if np.cos(angle) < SMALL_ANGLE_COSINE else np.sin(angle)
    np.testing.assert_allclose(newton.error, [0, 0, value, 0, 0, 0], atol=1e-12)


def test_factor_step_and_tangent_are_those_of_linear_algebra(chain, rng):
    arm, newton = numeric_arm(chain), new_newton_workspace()
    for _ in range(20):
        q = random_joints(rng, chain)
        to = pose(chain, q + rng.normal(scale=0.01, size=7))
        evaluate(arm, *to, q, newton)
        J = newton.J.copy()
        det = factorise(newton, 0.0)
        condition = np.linalg.cond(J) ** 2
        assert det == pytest.approx(np.linalg.det(J @ J.T), rel=1e-14 * condition + 1e-9)
        moved, before = q.copy(), np.eye(7)[rng.integers(7)]
        step_to_goal(newton, moved, 10.0)
        shortest = np.linalg.pinv(J) @ newton.error
        np.testing.assert_allclose(moved - q, shortest, atol=1e-13 * condition + 1e-12)
        tangent = np.empty(7)
        cosine = null_space_direction(newton, before, tangent)
        still = np.linalg.svd(J)[2][6]
        assert cosine == pytest.approx(abs(still @ before), abs=1e-14 * condition + 1e-9)
        if cosine > 0.1:
            np.testing.assert_allclose(J @ tangent, 0.0, atol=1e-13 * condition + 1e-9)
            assert tangent @ before > 0.0


def test_newton_converges_to_the_goal(chain, rng):
    arm, newton, arrived = numeric_arm(chain), new_newton_workspace(), 0
    for _ in range(50):
        q = random_joints(rng, chain)
        start = q + rng.uniform(-0.2, 0.2, 7)
        to = pose(chain, q)
        if converge(arm, *to, start, newton, 10, 1e-10):
            arrived += 1
            R, p = pose(chain, start)
            np.testing.assert_allclose(R, to[0], atol=1e-9)
            np.testing.assert_allclose(p, to[1], atol=1e-9)
    # Next to a singularity a few do not.
    assert arrived >= 45


ON_CURVES = {
    ISOTROPY: plain_dexterity.isotropy,
    INVERSE_CONDITION: plain_dexterity.inverse_condition,
    # Its weights are added at each candidate.
    LIMIT_WEIGHTED: plain_dexterity.isotropy,
}
"""Function of the Jacobian at the points of a curve, by its code."""


def test_the_values_on_curves_are_known_for_every_measure():
    unknown = {name for name, measure in MEASURES.items() if measure.of not in ON_CURVES}
    assert not unknown, (
        f"no value on curves for {sorted(unknown)}: compute it in `_append_point` of "
        "tcs/kernel/numeric/curves.py, and name its function in ON_CURVES"
    )


@pytest.mark.parametrize("of", sorted(set(ON_CURVES) - {LIMIT_WEIGHTED}))
def test_a_curve_holds_the_tool_still_from_point_to_point(chain, rng, of):
    arm, newton, checked, exact = numeric_arm(chain), new_newton_workspace(), 0, ON_CURVES[of]
    for _ in range(5):
        q = random_joints(rng, chain)
        to = pose(chain, q)
        curves = new_curves(4096, 8)
        curves.q_now[:] = q
        count = trace(arm, *to, curves, 0, 0.35, 0.2, of)
        # One way round, or to both ends.
        assert count in (1, 2)
        np.testing.assert_array_equal(curves.q[0], q)
        for k in range(count):
            for n in range(curves.first[k], curves.first[k + 1]):
                at = curves.q[n].copy()
                assert evaluate(arm, *to, at, newton) < 1e-5
                # Error of the posture before the last step, 3e-4.
                assert curves.value[n] == pytest.approx(
                    exact(reference.jacobian(chain, at)), abs=2e-3
                )
                if n + 1 == curves.first[k + 1]:
                    continue
                # Where curvature is small, a cubic over 0.2 rad is accurate to about 1e-5.
                point_between(curves, n, 0.5, at)
                assert evaluate(arm, *to, at, newton) < 2e-4
                assert curves.length[n] <= 0.25
                # Each joint keeps its limits up to the last stride.
                if n + 2 < curves.first[k + 1] and n > curves.first[k]:
                    assert slack_of(arm, curves.q[n].copy()) >= -0.35
                checked += 1
    assert checked > 20


def test_without_limits_a_curve_closes(rng):
    chain = offset_arm(np.random.default_rng(1))
    chain = chain._replace(lower=np.full(7, -np.inf), upper=np.full(7, np.inf))
    arm, closed = numeric_arm(chain), 0
    for _ in range(10):
        q = random_joints(rng, chain)
        curves = new_curves(4096, 8)
        curves.q_now[:] = q
        count = trace(arm, *pose(chain, q), curves, 0, 0.35, 0.2, ISOTROPY)
        ends = curves.q[[0, curves.first[1] - 1]]
        if count == 1:
            assert np.linalg.norm(around(ends[1] - ends[0])) < 0.25
            closed += 1
    assert closed >= 9


def test_solutions_hold_the_tool_in_drake_and_lie_near_the_given_posture(rng):
    arm = drake_arm("baxter")
    found = 0
    for _ in range(20):
        q = random_joints(rng, arm.chain)
        X_AT = arm.tool_pose(q)
        solutions = numeric_solutions(arm.chain, *X_AT)
        for solution in solutions:
            R, p = arm.tool_pose(solution)
            np.testing.assert_allclose(R, X_AT[0], atol=1e-8)
            np.testing.assert_allclose(p, X_AT[1], atol=1e-8)
            assert np.all((solution >= arm.chain.lower) & (solution <= arm.chain.upper))
        if len(solutions):
            off = np.linalg.norm(around(solutions - q), axis=1)
            # Half a stride along the curve; at its ends a whole one may be beyond the limits.
            found += off.min() < 0.2
    assert found >= 19


def test_postures_are_found_again_on_their_own_curves(rng):
    # Each pose is reachable by construction, so a posture that is not found is missed.
    any_found = own_found = drawn = 0
    for seed in range(8):
        chain = offset_arm(np.random.default_rng(100 + seed))
        for _ in range(40):
            q = random_joints(rng, chain)
            solutions = numeric_solutions(chain, *pose(chain, q))
            drawn += 1
            any_found += len(solutions) > 0
            # A stride is up to 0.2 rad, and at the ends of a curve one side may be beyond limits.
            off = np.linalg.norm(around(solutions - q), axis=1)
            own_found += bool(np.any(off < 0.21))
    # Measured over 4,800 postures of twelve arms: all but one, and all but seven.
    assert any_found >= 0.99 * drawn
    assert own_found >= 0.98 * drawn


def test_far_away_there_are_no_solutions():
    chain = drake_arm("baxter").chain
    assert numeric_solutions(chain, np.eye(3), np.array([3.0, 0.0, 0.0])).shape == (0, 7)
