"""ARPlace: the probability of a grasp over base positions, learned for varying task parameters.

In: a robot and a task of grasps on a table; for a query the pose of the object and its error. Out:
a model, its file, and maps of the probability of success with the best base position.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tcs.capability.arplace.boundary import Classifier
from tcs.capability.arplace.model import Arplace, Errors, reconstruction_errors
from tcs.capability.arplace.model_files import (
    load_arplace,
    load_probability_map,
    save_arplace,
    save_probability_map,
)
from tcs.capability.arplace.point_distribution import PointDistribution
from tcs.capability.arplace.probability_map import FloorObstacle, ProbabilityMap, merge_maps
from tcs.capability.arplace.query import ObjectPose, Query, covariance_of, query
from tcs.capability.arplace.success_model import SuccessModel
from tcs.capability.arplace.task import TableTask

if TYPE_CHECKING:
    from tcs.capability.arplace.learning import ModelOptions, learn

__all__ = [
    "Arplace",
    "Classifier",
    "Errors",
    "FloorObstacle",
    "ModelOptions",
    "ObjectPose",
    "PointDistribution",
    "ProbabilityMap",
    "Query",
    "SuccessModel",
    "TableTask",
    "covariance_of",
    "learn",
    "load_arplace",
    "load_probability_map",
    "merge_maps",
    "query",
    "reconstruction_errors",
    "save_arplace",
    "save_probability_map",
]


def __getattr__(name: str) -> Any:
    """Return a name of the module that learns, which needs Drake and the kernel."""
    if name not in ("ModelOptions", "learn"):
        raise AttributeError(f"module 'tcs.capability.arplace' has no attribute '{name}'")
    from tcs.capability.arplace import learning

    value = globals()[name] = getattr(learning, name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
