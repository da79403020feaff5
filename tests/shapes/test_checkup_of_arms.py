"""Arm classes with their distances, and a round trip that can fail."""

from dataclasses import replace

import numpy as np
import pytest

from tcs.kernel.arrays import Chain
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain
from tcs_shapes.checkup import arm_class, check_up, round_trip

UP, TURNED = np.eye(3), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def made_up(offsets):
    """Return an arm with square neighbouring axes; offsets[i] lies between axis i and i + 1."""
    R = np.stack([UP, *[TURNED] * 6, UP])
    p = np.zeros((8, 3))
    p[2], p[4] = [0.0, 0.0, 0.3], [0.0, 0.0, 0.3]
    p[3] = [0.05, 0.0, 0.0]
    for i, offset in offsets.items():
        p[i] = offset
    return Chain(R=R, p=p, lower=np.full(7, -2.0), upper=np.full(7, 2.0))


def test_axes_that_do_not_meet_are_measured():
    # Along x, square to both axes: the offset is the distance.
    found = arm_class(made_up({2: [0.07, 0.0, 0.3], 6: [0.02, 0.0, 0.0], 1: [0.01, 0.0, 0.0]}))
    assert found.name is None
    assert found.distances["2-3"] == pytest.approx(0.07, abs=1e-12)  # rounding
    assert found.distances["5-6-7"] == pytest.approx(0.02, abs=1e-12)
    assert found.distances["5-6"] == pytest.approx(0.0, abs=1e-12)
    assert "axes 2 and 3 pass each other 0.07 m apart" in found.reason


def test_axes_that_meet_in_different_points_are_measured():
    # Axis 6 meets 5 and 7, 3 cm apart along itself; L6 lies where it meets 5.
    found = arm_class(made_up({6: [0.0, 0.0, 0.03]}))
    assert found.distances["5-6"] == pytest.approx(0.0, abs=1e-12)
    assert found.distances["5-6-7"] == pytest.approx(0.03, abs=1e-12)


def test_parallel_axes_have_no_distance():
    chain = made_up({})
    chain.R[5] = UP
    assert arm_class(chain).distances["5-6"] is None


def test_a_wrong_solver_is_detected(pr2):
    """The round trip judges by Drake: a solver of an arm 1 mm longer recovers nothing."""
    scene = Scene(SceneSpec(pr2, EMPTY_ENVIRONMENT))
    chain, _ = arm_chain(scene)
    solver = arm_class(chain).solver
    assert round_trip(scene, solver, 20, seed=0).recovered == 20
    p = chain.p.copy()
    p[7] += [0.0, 0.0, 0.001]
    longer = arm_class(chain._replace(p=p)).solver
    assert round_trip(scene, longer, 20, seed=0).recovered == 0


@pytest.mark.slow
def test_a_numeric_solver_that_finds_too_little_is_a_problem(pr2):
    found = check_up(pr2, samples=1)
    outside = replace(found.arm, name=None, solver=None, reason="Axes pass each other.")
    nothing = replace(found.trip, method="numeric", samples=100, recovered=94, joint_error=None)
    broken = replace(found, arm=outside, trip=nothing)
    assert broken.problems == (
        "no solution for 6 of 100 tool poses of random postures: scoring would miss too many "
        "goals.",
    )
    assert replace(broken, trip=replace(nothing, recovered=95)).problems == ()
    assert "solved numerically" in broken.notes[0]


def test_a_closed_arm_is_solved_numerically_too(pr2):
    """Without the closed form, Drake still has to confirm the solutions."""
    scene = Scene(SceneSpec(pr2, EMPTY_ENVIRONMENT))
    trip = round_trip(scene, None, 20, seed=0)
    assert (trip.method, trip.joint_error) == ("numeric", None)
    # It found solutions for 200 of 200 poses; one of 20 may be missed by chance.
    assert trip.recovered >= 19
    assert trip.solutions > trip.recovered
    assert trip.position_error < 1e-8
