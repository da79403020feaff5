"""Statistics of the experiment, as in the ITCM thesis, III.C.5 and Appendix F."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray
from tcs_studies.experiment.statistics import (
    RepeatedMeasures,
    Tail,
    kolmogorov_smirnov,
    repeated_measures,
)
from tcs_studies.pick_and_place.protocol import Part, PickAndPlace, failure_counts
from tcs_studies.pick_and_place.repetition import MEASURES

TESTED: dict[str, Tail] = {
    "tct": "greater", "csa": "greater", "cst": "greater", "sal": "two-sided",
    "csa_rate": "greater", "cst_rate": "greater",
    "approach": "greater", "transfer": "greater", "retreat": "greater",
}  # fmt: skip
"""Measures that the thesis tests, and the alternative hypothesis about a condition that is expected
to be worse; the thesis has no post-hoc test of the arc length."""
_LEAST = 3
"""Least number of operators of a test."""


@dataclass(frozen=True, slots=True)
class LearningCurve:
    """Power law a x^b + c of the completion time in the x-th repetition [s]."""

    a: float
    b: float
    c: float

    def at(self, repetition: FloatArray) -> FloatArray:
        """Return the completion time of repetitions, counted from 1 [s]."""
        return np.asarray(self.a * np.asarray(repetition, dtype=np.float64) ** self.b + self.c)


def complete(result: PickAndPlace) -> FloatArray:
    """Return the indices of operators with a successful repetition from every base pose."""
    names = [condition.name for condition in result.plan.conditions]
    times = np.stack([result.sample(name, "tct") for name in names])
    return np.asarray(np.flatnonzero(np.isfinite(times).all(axis=0)))


def time_with_failures(result: PickAndPlace, condition: str) -> float:
    """Return the mean time of the recorded repetitions of all operators [s].

    A failed repetition counts with the time limit, so that base poses from which few or no
    repetitions succeed can be ranked with the others.

    Args:
        result: The experiment.
        condition: Name of the base pose.
    """
    times: list[float] = []
    for operator in result.operators:
        part = operator.recorded[condition]
        times += [one.tct for one in part.successes]
        times += [result.plan.time_limit] * len(part.failures)
    return float(np.mean(times))


def compared(result: PickAndPlace) -> dict[str, RepeatedMeasures]:
    """Return the analysis of variance of each measure over the base poses.

    Conditions are in the reverse of their order in the plan, so that the alternative of the
    one-tailed tests is the thesis's: ITCM-low needs more than ITCM-high, and that more than Expert.
    Operators without a successful repetition from one of the base poses are left out. Empty with
    fewer than two conditions or three operators; a measure whose test is undefined is left out.
    """
    names = [condition.name for condition in reversed(result.plan.conditions)]
    rows = complete(result)
    found: dict[str, RepeatedMeasures] = {}
    if len(names) < 2 or len(rows) < _LEAST:
        return found
    for measure, tail in TESTED.items():
        samples = {name: result.sample(name, measure)[rows] for name in names}
        try:
            found[measure] = repeated_measures(samples, tail=tail)
        except DataFileError:
            # The differences are the same for all operators.
            continue
    return found


def normality(result: PickAndPlace) -> dict[str, dict[str, float]]:
    """Return the p value of the test of normality by measure and condition (Tables 5 and 6).

    Empty with fewer than three operators with a successful repetition.
    """
    found: dict[str, dict[str, float]] = {}
    for measure in TESTED:
        for condition in result.plan.conditions:
            sample = result.sample(condition.name, measure)
            sample = sample[np.isfinite(sample)]
            if len(sample) >= _LEAST:
                found.setdefault(measure, {})[condition.name] = kolmogorov_smirnov(sample)
    return found


def learning_curve(parts: tuple[Part, ...]) -> LearningCurve | None:
    """Return the power law through the completion times of repetitions of all operators.

    Args:
        parts: One part of the protocol of each operator.

    Returns:
        The least-squares fit; None with fewer than four numbered repetitions, or if it does not
        converge.

    Source:
        ITCM thesis, Appendix F.2: y = a x^b + c.
    """
    from scipy.optimize import curve_fit

    pairs = [(i, one.tct) for part in parts for i, one in enumerate(part.successes, start=1)]
    if len({i for i, _ in pairs}) < 4:
        return None
    x, y = np.array(pairs, dtype=np.float64).T
    start = (max(float(y[x == 1].mean() - y.min()), 1e-3), -0.5, float(y.min()))
    bounds = ((0.0, -5.0, -np.inf), (np.inf, 0.0, np.inf))
    try:
        (a, b, c), _ = curve_fit(lambda x, a, b, c: a * x**b + c, x, y, p0=start, bounds=bounds)
    except RuntimeError:
        return None
    return LearningCurve(float(a), float(b), float(c))


def summary(result: PickAndPlace) -> dict[str, Any]:
    """Return means, standard deviations, failures and tests.

    Means and deviations are those of the operators' means, as in the thesis's Table 2; None where
    they are not defined.

    Args:
        result: The experiment.
    """
    plan = result.plan
    return {
        "scripted": True,
        "operators": plan.operators,
        "repetitions": plan.repetitions,
        "training": plan.practice,
        "seed": plan.seed,
        "control": plan.control.value,
        **plan.coupling.latency.to_json(),
        "conditions": {one.name: _condition(result, one.name) for one in plan.conditions},
        "variance": {name: found.to_json() for name, found in compared(result).items()},
        "normality": normality(result),
    }


def _condition(result: PickAndPlace, name: str) -> dict[str, Any]:
    setting = result.settings[name]
    recorded = tuple(one.recorded[name] for one in result.operators)
    curve = learning_curve(recorded)
    return {
        "x": setting.condition.x,
        "y": setting.condition.y,
        "yaw_deg": setting.condition.yaw_deg,
        "camera_yaw_deg": math.degrees(setting.camera.angle),
        **{measure: spread(result.sample(name, measure)) for measure in MEASURES},
        "failures": result.failures(name),
        "failure_types": failure_counts([one for part in recorded for one in part.failures]),
        "training_failures": result.failures(name, training=True),
        "learning_curve": None if curve is None else asdict(curve),
    }


def spread(sample: FloatArray) -> dict[str, float | None]:
    """Return mean and standard deviation of the finite values, None where not defined."""
    values = sample[np.isfinite(sample)]
    return {
        "mean": float(values.mean()) if len(values) else None,
        "std": float(values.std(ddof=1)) if len(values) > 1 else None,
    }
