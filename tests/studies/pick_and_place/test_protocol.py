"""The protocol and its statistics."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs_studies.pick_and_place.analysis import (
    compared,
    learning_curve,
    normality,
    summary,
    time_with_failures,
)
from tcs_studies.pick_and_place.phases import Traits
from tcs_studies.pick_and_place.protocol import (
    OperatorResult,
    Part,
    PickAndPlace,
    Plan,
    run_pick_and_place,
)
from tcs_studies.pick_and_place.repetition import MEASURES, Measures, Outcome
from tcs_studies.pick_and_place.task import CONDITIONS, ITCM_HIGH


@pytest.fixture(scope="module")
def small(tiago):
    plan = Plan(operators=1, repetitions=2, training=0, conditions=(ITCM_HIGH,))
    return run_pick_and_place(plan, tiago)


def made(times, plan):
    """Return an experiment whose operators took given times, by condition."""
    settings = {}
    operators = []
    for i in range(plan.operators):
        parts = {
            name: Part(
                tuple(Measures(**(dict.fromkeys(MEASURES, 1.0 + i) | {"tct": t})) for t in row[i]),
                (Outcome.TOPPLED,) * (3 - len(row[i])),
                (),
            )
            for name, row in times.items()
        }
        operators.append(OperatorResult(Traits(), Part((), (), ()), parts, parts))
    return PickAndPlace(plan, settings, tuple(operators))


TIMES = {
    "Expert": [[20.0, 22.0], [24.0], [21.0], [26.0]],
    "ITCM-high": [[19.0], [23.0], [22.0], [24.0]],
    "ITCM-low": [[40.0], [55.0], [38.0], [61.0]],
}


def test_every_part_has_its_successes(small):
    (operator,) = small.operators
    assert len(operator.familiarisation.successes) == 2
    assert len(operator.recorded["ITCM-high"].successes) == 2
    assert operator.training["ITCM-high"].successes == ()
    times, *places = operator.recorded["ITCM-high"].paths[0].T
    assert times[-1] == operator.recorded["ITCM-high"].successes[0].tct
    assert len(places) == 3


def test_the_summary_is_json_with_the_contracted_keys(small):
    found = json.loads(json.dumps(summary(small)))
    one = found["conditions"]["ITCM-high"]
    assert {"tct", "csa", "cst", "sal", "failures"} <= set(one)
    assert one["tct"]["mean"] == pytest.approx(small.sample("ITCM-high", "tct").mean())
    assert one["tct"]["std"] is None
    assert one["failures"] == small.failures("ITCM-high")
    assert found["variance"] == {}


def test_operators_take_all_orders():
    plan = Plan()
    assert len({plan.order(operator) for operator in range(6)}) == 6
    assert all(set(plan.order(operator)) == set(CONDITIONS) for operator in range(6))


@pytest.mark.parametrize(
    "values",
    [
        {"operators": 0},
        {"repetitions": 0},
        {"training": -1},
        {"conditions": ()},
        {"conditions": (ITCM_HIGH, ITCM_HIGH)},
        {"time_limit": 0.0},
    ],
)
def test_an_impossible_plan_is_refused(values):
    with pytest.raises(TcsError, match="pick and place"):
        Plan(**values)


def test_the_tests_compare_the_means_of_operators():
    result = made(TIMES, Plan(operators=4))
    found = compared(result)["tct"]
    means = [np.array([np.mean(row) for row in TIMES[c.name]]) for c in CONDITIONS]
    first = found.post_hoc[0]
    assert (first.first, first.second) == ("ITCM-low", "ITCM-high")
    assert first.difference == pytest.approx((means[2] - means[1]).mean())
    assert first.p < 0.05
    # In sal all conditions are equal, so it has no test.
    assert "sal" not in compared(result)
    assert set(normality(result)["tct"]) == set(TIMES)


def test_an_operator_without_a_success_is_left_out_of_the_tests():
    times = {
        name: [*rows[:3], [] if name == "ITCM-low" else rows[3]] for name, rows in TIMES.items()
    }
    result = made(times, Plan(operators=4))
    assert np.isnan(result.sample("ITCM-low", "tct")[3])
    shorter = made({name: rows[:3] for name, rows in TIMES.items()}, Plan(operators=3))
    assert compared(result)["tct"].f == pytest.approx(compared(shorter)["tct"].f)
    assert result.failures("ITCM-low") == 9


def test_a_failure_counts_with_the_time_limit():
    result = made(TIMES, Plan(operators=4, time_limit=100.0))
    rows = [time for row in TIMES["ITCM-low"] for time in row]
    failures = [100.0] * result.failures("ITCM-low")
    assert time_with_failures(result, "ITCM-low") == pytest.approx(np.mean(rows + failures))


def test_the_learning_curve_recovers_a_power_law():
    one = Measures(**dict.fromkeys(MEASURES, 1.0))
    x = np.arange(1, 15)
    times = 30.0 * x**-0.7 + 12.0
    part = Part(tuple(replace(one, tct=float(t)) for t in times), (), ())
    curve = learning_curve((part, part))
    np.testing.assert_allclose([curve.a, curve.b, curve.c], [30.0, -0.7, 12.0], rtol=1e-4)
    np.testing.assert_allclose(curve.at(x), times, rtol=1e-6)
    assert learning_curve((Part(part.successes[:3], (), ()),)) is None
