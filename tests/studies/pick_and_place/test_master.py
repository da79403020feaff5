"""Workspace, tremor and force of the master."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs_studies.pick_and_place.master import PERIOD, Coupling, Master, drawn_tremor
from tcs_studies.pick_and_place.task import START
from tcs_studies.simulated_recording import MASTER_BOX

STILL = np.zeros((1, 6))


def test_the_hand_stays_in_the_workspace():
    coupling = Coupling()
    master = Master(coupling, STILL)
    master.move(np.array([9.0, -9.0, 9.0]), np.array([9.0, -9.0, 9.0]))
    low = master.p.copy()
    master.move(np.array([-9.0, 9.0, -9.0]), np.zeros(3))
    np.testing.assert_allclose(
        np.abs(low - master.p), coupling.scale * np.array(MASTER_BOX), rtol=1e-12
    )


def test_the_force_is_a_stiffness_behind_a_filter_of_10_hz():
    coupling = Coupling(scale=5.0, stiffness=800.0)
    master = Master(coupling, STILL)
    depth = 0.01
    steady = 800.0 * depth / 5.0
    for sample in range(1, 40):
        master.feel(depth)
        filtered = steady * (1.0 - math.exp(-2.0 * math.pi * 10.0 * PERIOD * sample))
        assert master.force == pytest.approx(filtered, rel=1e-12)
    # It pushes the hand up.
    assert master.sample()[0][2] > START[2]
    for _ in range(40):
        master.feel(1.0)
    assert master.force == pytest.approx(3.3)


def test_tremor_has_its_deviation_and_is_near_9_hz():
    tremor = drawn_tremor(np.random.default_rng(0), 38e-6, 0.05)
    np.testing.assert_allclose(tremor[:, :3].std(axis=0), 38e-6)
    np.testing.assert_allclose(tremor[:, 3:].std(axis=0), 38e-6 / 0.05)
    power = (np.abs(np.fft.rfft(tremor[:, 0])) ** 2).reshape(-1)[1:]
    frequency = np.fft.rfftfreq(len(tremor), PERIOD)[1:]
    assert 8.0 < (frequency * power).sum() / power.sum() < 11.0


@pytest.mark.parametrize("values", [{"stiffness": -1.0}, {"stiffness": math.nan}, {"scale": 0.0}])
def test_impossible_couplings_are_refused(values):
    with pytest.raises(TcsError, match="coupling"):
        Coupling(**values)
