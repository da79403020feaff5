"""Results of the experiment as plain containers."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs_studies.pick_and_place.analysis import compared, learning_curve, normality
from tcs_studies.pick_and_place.measures import MEASURES
from tcs_studies.pick_and_place.protocol import PickAndPlace, failure_counts


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
