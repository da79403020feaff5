"""Positions of the joints that follow a joint."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.scene.person.posture import Posture

TURNING = Posture(
    knots_deg=(0, 40, 80), joints={"a": (-0.1, -0.2, -0.55), "b": (0.4, -0.17, -0.51)}
)


@pytest.mark.parametrize(
    ("deg", "a", "b"),
    [
        (0, -0.1, 0.4),
        # hrl_base_selection's own figures at 35 and 70 deg, the seventh eighth of the first
        # stretch and the third quarter of the second.
        (35, -0.1875, -0.09875),
        (40, -0.2, -0.17),
        (70, -0.4625, -0.425),
        (80, -0.55, -0.51),
    ],
)
def test_joints_move_in_proportion_between_the_knots(deg, a, b):
    positions = TURNING.positions(np.radians(deg))
    # Rounding of degrees to radians.
    assert positions == pytest.approx({"a": a, "b": b}, abs=1e-12)


def test_a_prismatic_leader_has_knots_in_metres():
    posture = Posture(knots=(0.0, 0.5), joints={"a": (0.0, 1.0)})
    assert not posture.is_revolute
    assert posture.leading == (0.0, 0.5)
    assert posture.positions(0.2) == pytest.approx({"a": 0.4}, abs=1e-15)


def test_a_revolute_leader_has_knots_in_degrees():
    assert TURNING.is_revolute
    assert TURNING.leading == pytest.approx(np.radians([0, 40, 80]), abs=1e-15)
