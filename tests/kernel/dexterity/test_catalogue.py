"""Dexterity measures: names, closed forms, and comparison with numpy on Drake's Jacobian."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.errors import UnknownNameError
from tcs.kernel.dexterity import MEASURES, NORMALISED, THESIS, UNLIMITED, dexterity
from tcs.kernel.dexterity.measures import (
    eigenvalue_from,
    inverse_condition,
    limit_penalty,
    measure_at,
    tridiagonalise,
)
from tcs.kernel.problem import build_problem
from tcs.kernel.verification import plain_dexterity
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import random_joints, rotation, turned_by
from tests.kernel.toy import toy_scene
from tests.reference import kinematics as reference

LOWER, UPPER = np.linspace(-2.0, -1.0, 7), np.linspace(1.5, 2.5, 7)
STEP = 1e-6


def orthogonal(rng, n):
    return np.linalg.qr(rng.normal(size=(n, n)))[0]


def expected(J, q, lower, upper, measure):
    """Return the measure by numpy, straight from the equations."""
    if measure == "jlwki":
        half = (upper - lower) / 2
        with np.errstate(invalid="ignore"):
            near = (half - abs(half - q + lower)) / (0.05 * half) + 1
        weights = np.where(np.isfinite(half), np.maximum(0.001, 1 - 0.5**near), 1.0)
        J = J @ np.diag(np.sqrt(weights))
    sigma = np.linalg.svd(J, compute_uv=False)
    if measure.startswith("inverse-condition"):
        value = sigma[-1] / sigma[0]
    elif measure.startswith(("isotropy", "jlwki")):
        value = np.prod(sigma**2) ** (1 / 6) / np.mean(sigma**2)
    else:
        pytest.fail(f"no equation of the measure '{measure}' here: write it, independently")
    if "limited" not in measure:
        return value
    factors = [
        (a - low) * (high - a) / (high - low) ** 2
        for a, low, high in zip(q, lower, upper, strict=True)
        if math.isfinite(low)
    ]
    rest = 1.0 if measure.endswith("thesis") else 0.25 ** (7 - len(factors))
    return value * (1 - math.exp(-1e6 * rest * math.prod(factors)))


@pytest.mark.parametrize("measure", MEASURES)
def test_every_measure_is_its_equation_on_drakes_jacobian(scene, lowered, rng, measure):
    chain = lowered.arrays.chain
    problem = build_problem(lowered.arrays, measure)
    for _ in range(20):
        q = random_joints(rng, chain)
        scene.set_arm(q)
        exact = expected(scene.tool_jacobian(), q, *scene.arm_limits, measure)
        # Rounding of 1e-16, magnified by the condition number, here up to some hundreds, twice:
        # the eigenvalues are those of J J^T.
        assert measure_at(problem, q) == pytest.approx(exact, abs=1e-10)


@pytest.mark.parametrize("measure", MEASURES)
def test_every_measure_is_its_equation_on_drakes_finite_differences(scene, lowered, rng, measure):
    chain = lowered.arrays.chain
    problem = build_problem(lowered.arrays, measure)
    for _ in range(5):
        q = random_joints(rng, chain)
        J = np.empty((6, 7))
        for i in range(7):
            poses = []
            for sign in (1, -1):
                scene.set_arm(q + sign * STEP * np.eye(7)[i])
                poses.append(scene.tool_pose())
            after, before = (X_WT.rotation().matrix() for X_WT in poses)
            J[:3, i] = turned_by(after @ before.T) / (2 * STEP)
            J[3:, i] = (poses[0].translation() - poses[1].translation()) / (2 * STEP)
        exact = expected(J, q, *scene.arm_limits, measure)
        # Central differences: STEP^2 plus rounding 1e-16 / STEP, magnified by the condition number.
        assert measure_at(problem, q) == pytest.approx(exact, abs=1e-7)


@pytest.mark.parametrize("arm", ["pr2", "panda"])
@pytest.mark.parametrize("measure", MEASURES)
def test_every_measure_agrees_with_the_reference(lowered, rng, arm, measure):
    chain = lowered.arrays.chain if arm == "pr2" else drake_arm("panda").chain
    problem = build_problem(toy_scene(chain, 0), measure)
    for _ in range(30):
        q = random_joints(rng, chain)
        J = reference.jacobian(chain, q)
        exact = plain_dexterity.measured(J, q, chain.lower, chain.upper, measure)
        assert measure_at(problem, q) == pytest.approx(exact, abs=1e-10)
        assert 0.0 <= exact <= 1.0


@pytest.mark.parametrize("elbow", np.linspace(0.1, 3.0, 7))
def test_inverse_condition_of_a_two_link_arm_is_the_closed_form(elbow, rng):
    l1, l2 = math.sqrt(2.0), 1.0
    s, c = math.sin(elbow), math.cos(elbow)
    J = np.zeros((6, 7))
    J[:2, :2] = [[-l2 * s, -l2 * s], [l1 + l2 * c, l2 * c]]
    # The two singular values from their product, |det|, and the sum of their squares.
    det, total = l1 * l2 * s, l1 * l1 + 2 * l2 * l2 + 2 * l1 * l2 * c
    J[0, 0] = -l2 * s
    root = math.sqrt(total * total - 4 * det * det)
    exact = math.sqrt((total - root) / (total + root))
    # Four more singular values in between change nothing; after a rotation none is along an axis.
    J[2:, 2:6] = math.sqrt(det) * np.eye(4)
    turned = orthogonal(rng, 6) @ J @ orthogonal(rng, 7)
    assert inverse_condition(np.ascontiguousarray(turned)) == pytest.approx(exact, abs=1e-12)
    assert inverse_condition(J) == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize(
    "values",
    [
        [1, 1, 1, 1, 1, 1],
        [3, 3, 3, 1, 1, 1],
        [5, 1, 1, 1, 1, 1],
        [5, 5, 5, 5, 5, 1],
        [1, 2, 3, 4, 5, 6],
        [9, 1, 1e-2, 1e-3, 1e-4, 1e-4],
        [1, 1 + 1e-9, 2, 2, 2 - 1e-9, 2],
        [4, 1, 1, 0, 0, 0],
        [4, 1, 1, 1, 1, 0],
    ],
    ids=str,
)
def test_extreme_eigenvalues_are_those_of_numpy(values, rng):
    values = np.array(values, float)
    for turn in (np.eye(6), np.eye(6)[::-1], orthogonal(rng, 6), orthogonal(rng, 6)):
        G = turn @ np.diag(values) @ turn.T
        G = (G + G.T) / 2
        diagonal, square = np.empty(6), np.empty(6)
        tridiagonalise(G.copy(), diagonal, square)
        T = np.diag(diagonal) + np.diag(np.sqrt(square[1:]), 1) + np.diag(np.sqrt(square[1:]), -1)
        # Rounding of some hundred operations, of the greatest eigenvalue.
        bar = 1e-14 * values.max()
        np.testing.assert_allclose(np.linalg.eigvalsh(T), np.sort(values), rtol=0, atol=bar)
        most = eigenvalue_from(diagonal, square, np.linalg.norm(values))
        # Where several coincide, Newton's steps end a little before rounding does.
        assert most == pytest.approx(values.max(), abs=100 * bar)
        least = eigenvalue_from(diagonal, square, 0.0)
        assert least == pytest.approx(values.min(), abs=100 * bar)


def test_a_singular_jacobian_has_inverse_condition_zero(lowered, rng):
    chain = lowered.arrays.chain
    problem = build_problem(lowered.arrays, "inverse-condition")
    # The root of rounding, 1e-15: singular values come from J J^T.
    assert measure_at(problem, np.zeros(7)) < 1e-7
    assert plain_dexterity.inverse_condition(reference.jacobian(chain, np.zeros(7))) < 1e-15
    for _ in range(20):
        J = rng.normal(size=(6, 5)) @ rng.normal(size=(5, 7))
        assert inverse_condition(J) < 1e-7


def test_inverse_condition_does_not_depend_on_the_frame(lowered, rng):
    J = reference.jacobian(lowered.arrays.chain, random_joints(rng, lowered.arrays.chain))
    R = rotation(rng)
    turned = np.vstack([R @ J[:3], R @ J[3:]])
    # Rounding, magnified by the condition number.
    assert inverse_condition(turned) == pytest.approx(inverse_condition(J), abs=1e-10)


@pytest.mark.parametrize("penalty", [NORMALISED, THESIS])
@pytest.mark.parametrize("which", range(7))
def test_a_joint_at_its_limit_has_measure_zero(penalty, which):
    for limit in (LOWER, UPPER):
        q = (LOWER + UPPER) / 2
        q[which] = limit[which]
        assert limit_penalty(q, LOWER, UPPER, penalty) == 0.0


@pytest.mark.parametrize("limited", range(8))
def test_in_the_middle_of_all_limits_the_normalised_penalty_is_one(limited):
    lower, upper = LOWER.copy(), UPPER.copy()
    lower[limited:], upper[limited:] = -np.inf, np.inf
    q = np.where(np.isfinite(lower), (LOWER + UPPER) / 2, 2.0)
    assert limit_penalty(q, lower, upper, NORMALISED) == 1.0
    # As printed, it depends on how many joints have limits.
    printed = 1 - math.exp(-1e6 / 4**limited)
    assert limit_penalty(q, lower, upper, THESIS) == pytest.approx(printed, rel=1e-12)


def test_the_penalty_is_the_printed_one_where_seven_joints_have_limits(rng):
    for _ in range(20):
        q = rng.uniform(LOWER, UPPER)
        # One joint in ten thousandths of its range, where the penalty is neither 0 nor 1.
        q[3] = LOWER[3] + 1e-4 * rng.uniform() * (UPPER[3] - LOWER[3])
        product = np.prod((q - LOWER) * (UPPER - q) / (UPPER - LOWER) ** 2)
        exact = 1 - math.exp(-1e6 * product)
        # 1 - exp loses what is below 1e-16.
        for penalty in (NORMALISED, THESIS):
            assert limit_penalty(q, LOWER, UPPER, penalty) == pytest.approx(exact, abs=1e-13)
        assert limit_penalty(q, LOWER, UPPER, UNLIMITED) == 1.0


def test_the_normalised_penalty_of_wide_limits_is_that_of_none(rng):
    q = rng.uniform(LOWER, UPPER)
    q[2] = LOWER[2] + 1e-4
    continuous, wide = (LOWER.copy(), UPPER.copy()), (LOWER.copy(), UPPER.copy())
    continuous[0][4], continuous[1][4] = -np.inf, np.inf
    wide[0][4], wide[1][4] = -1e8, 1e8
    exact = limit_penalty(q, *continuous, NORMALISED)
    assert 0.0 < exact < 1.0
    assert limit_penalty(q, *wide, NORMALISED) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "meant"),
    [("isotropi", "isotropy"), ("inverse_condition", "inverse-condition")],
)
def test_an_unknown_measure_is_reported_with_the_nearest_name(name, meant):
    with pytest.raises(UnknownNameError) as caught:
        dexterity(name)
    message = str(caught.value)
    assert message.startswith(f"unknown measure '{name}'. Known: inverse-condition, ")
    assert message.endswith(f"Did you mean '{meant}'?")
