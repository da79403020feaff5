"""ARPlace: the probability of a grasp over base positions, learned for varying task parameters.

In: a robot and a task of grasps on a table; for a query the pose of the object and its error. Out:
a model, its file, and maps of the probability of success with the best base position.
"""

from __future__ import annotations

from tcs.capability.arplace.boundary import Classifier
from tcs.capability.arplace.files import (
    load_arplace,
    load_probability_map,
    save_arplace,
    save_probability_map,
)
from tcs.capability.arplace.learning import ModelOptions, learn
from tcs.capability.arplace.model import Arplace, Errors, reconstruction_errors
from tcs.capability.arplace.point_distribution import PointDistribution
from tcs.capability.arplace.probability_map import FloorObstacle, ProbabilityMap, merge_maps
from tcs.capability.arplace.query import ObjectPose, Query, covariance_of, query
from tcs.capability.arplace.success_model import SuccessModel
from tcs.capability.arplace.task import TableTask

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
