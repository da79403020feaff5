"""Plans under error: whether motions stay free of contact where the person lies or sits off."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.trees import new_trees
from tcs.model.scene import LoweredScene, Scene, lower
from tcs.model.scene.lowering import environment_at
from tcs.motion.motion_plan import MotionPlan, Segment, StopPlan
from tcs.motion.plan_check import check_names
from tcs.motion.plans import value_of
from tcs.motion.stop_tour import plan_stop
from tcs.motion.stops import Stop, StopGrid, single_grid
from tcs.placement.robustness import ErrorModel, Mean, mean_of
from tcs.placement.robustness.displacements import displaced
from tcs.placement.robustness.trials import Errors, Progress
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_made_from

_STREAM = "plan"
"""Name of the draw of errors."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanSuccess:
    """In which samples the motions of a plan stay free of contact; arrays are read-only."""

    blind: NDArray[np.bool_]
    """Whether the motions of each stop touch nothing as planned, shape (samples, stops)."""
    replanned: NDArray[np.bool_] | None
    """Whether motions to all goals that the stop does were found anew, shape (samples, stops)."""
    clipped: int
    """Number of samples in which an error is limited at a joint limit."""
    errors: ErrorModel
    """Error model of the joints."""
    seed: int
    """Seed of the samples, and of the planner."""
    seconds: float
    """Duration [s]."""

    @cached_property
    def free(self) -> Mean:
        """Fraction of the samples in which the motions of all stops touch nothing."""
        return mean_of(self.blind.all(axis=1))

    @cached_property
    def done_again(self) -> Mean | None:
        """Fraction of the samples in which all goals can be done by motions planned anew."""
        return None if self.replanned is None else mean_of(self.replanned.all(axis=1))

    def to_json(self) -> dict[str, Any]:
        """Return the figures as plain containers, as printed by `tcs evaluate plan.json`."""
        again = None
        if self.done_again is not None and self.replanned is not None:
            again = _figures(self.done_again, self.replanned)
        return {
            "blind": _figures(self.free, self.blind),
            "replanned": again,
            "samples": len(self.blind),
            "seed": self.seed,
            "errors": self.errors.to_json(),
            "clipped": self.clipped,
            "seconds": self.seconds,
        }


def evaluate_plan(
    plan: MotionPlan,
    *,
    samples: int = 100,
    seed: int = 0,
    errors: Errors = None,
    replan: bool = True,
    on_progress: Progress = None,
) -> PlanSuccess:
    """Return whether the motions of a plan stay free when the environment is perturbed.

    In each sample the joints of the error model are displaced by random errors, as `evaluate` does.
    The motions are played as planned, without knowledge of the errors, and must keep the distances
    that scoring requires; and motions to the same goals, which move with the person, are planned
    anew with knowledge of them. The base stands where planned.

    Args:
        plan: The plan, e.g. from `load_plan`.
        samples: Number of samples.
        seed: Seed of the samples and of the planner.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
        replan: Whether motions are planned anew.
        on_progress: Called with the number of samples done and in all.

    Raises:
        StoreMismatchError: If the models have changed since the plan was made.
        StoreFormatError: If it names goals, joints or axes that its scene does not have.
        TcsError: If the plan has no motion, no joint has an error, or a number is out of range.
    """
    begun = time.perf_counter()
    job, scene = rebuild_made_from(plan.made_from)
    check_names(plan, job)
    stops = [planned for planned in plan.stops if planned.segments]
    if not stops:
        raise TcsError("The plan has no motions, so there is nothing to evaluate.")
    model = ErrorModel.of(scene, errors)
    offsets = model.draw(samples, seed, stream=_STREAM)
    places = [_Place.of(planned, job, scene) for planned in stops]
    displacements = [displaced(job, scene, place.nominal, offsets) for place in places]
    jerk = None if plan.jerk_limits is None else np.array(plan.jerk_limits)
    blind = np.zeros((samples, len(places)), dtype=np.bool_)
    again = np.zeros_like(blind)
    for i in range(samples):
        for number, (place, (positions, _)) in enumerate(zip(places, displacements, strict=True)):
            state = {name: float(values[i]) for name, values in positions.items()}
            stop = place.displaced(state, seed)
            blind[i, number] = _is_free(stop, place.planned)
            if replan:
                found, _ = plan_stop(stop, None, number, place.planned.goals, jerk=jerk)
                again[i, number] = set(found.goals) == set(place.planned.goals)
        if on_progress is not None:
            on_progress(i + 1, samples)
    limited = np.any([clipped for _, clipped in displacements], axis=0)
    return PlanSuccess(
        blind=blind,
        replanned=again if replan else None,
        clipped=int(np.count_nonzero(limited)),
        errors=model,
        seed=seed,
        seconds=time.perf_counter() - begun,
    )


@dataclass(frozen=True, eq=False)
class _Place:
    """A stop of a plan, lowered without errors."""

    planned: StopPlan
    job: Job
    scene: Scene
    lowered: LoweredScene
    stops: StopGrid
    values: Mapping[str, float]
    """Value of each axis [m or rad]."""

    @classmethod
    def of(cls, planned: StopPlan, job: Job, scene: Scene) -> _Place:
        """Lower the scene at a stop of a plan."""
        axes = job.scored_grid.axes
        values = {axis.name: value_of(planned.at, axis.name) for axis in axes}
        grid = single_grid(axes, list(values.values()))
        lowered = lower(scene, job.task, grid)
        return cls(planned, job, scene, lowered, StopGrid.of(job, scene, grid, lowered), values)

    @property
    def nominal(self) -> dict[str, float]:
        """Positions of the environment's joints without error [m or rad]."""
        return {
            axis.name: self.values[axis.name] for axis in self.stops.configurations.environment_axes
        }

    def displaced(self, state: Mapping[str, float], seed: int) -> Stop:
        """Return the stop with the environment's joints at some positions, the live scene too."""
        arrays = environment_at(self.lowered, self.scene, self.job.task, [state])
        lowered = dataclasses.replace(self.lowered, arrays=arrays)
        stop = self.stops.with_environment(lowered).stop(0, new_trees(seed))
        stop.place({**self.values, **state})
        for name, value in state.items():
            self.scene.set_joint(name, value)
        return stop


def _is_free(stop: Stop, planned: StopPlan) -> bool:
    """Return whether the motions of a stop touch nothing; virtual walls do not count."""
    return not stop.scene.violations() and all(
        _segment_is_free(stop, segment) for segment in planned.segments
    )


def _segment_is_free(stop: Stop, segment: Segment) -> bool:
    return all(
        certified(stop.lines, stop.line_work, curve.control_points(piece)) == 1.0
        for curve in segment.curves
        for piece in range(curve.pieces)
    )


def _figures(mean: Mean, by_stop: NDArray[np.bool_]) -> dict[str, Any]:
    return {
        "mean": mean.mean,
        "ci95": None if mean.ci95 is None else list(mean.ci95),
        "per_stop": by_stop.mean(axis=0).tolist(),
    }
