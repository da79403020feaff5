"""Plans under error: whether motions stay free of contact where the person lies or sits off."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.search_trees import new_trees
from tcs.model.scene import LoweredScene, lower
from tcs.model.scene.lowering import environment_at
from tcs.motion.motion_plan import MotionPlan, Segment, StopPlan
from tcs.motion.plan_check import PlanHand, hands_of
from tcs.motion.plans import value_of
from tcs.motion.stop_tour import plan_stop
from tcs.motion.stops import BodyPair, Stop, StopGrid, single_grid
from tcs.placement.robustness import ErrorModel, Mean, mean_of
from tcs.placement.robustness.body_collisions import base_bodies
from tcs.placement.robustness.error_model import displaced
from tcs.placement.robustness.trials import Errors, Progress

_STREAM = "plan"
"""Name of the draw of errors."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanSuccess:
    """In which samples the motions of a plan stay free of contact; arrays are read-only."""

    blind: NDArray[np.bool_]
    """Whether the motions of each stop touch nothing as planned, shape (samples, stops)."""
    replanned: NDArray[np.bool_] | None
    """Whether motions to all goals that the stop does were found anew, from there or, where that
    fails, from another stop of the plan, shape (samples, stops)."""
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
    anew with knowledge of them: a goal that is lost at its stop is tried from the other stops too.
    The base stands where planned; its contacts with the furniture do not count, as in `evaluate`.

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
    hands = hands_of(plan)
    stops = [planned for planned in plan.stops if planned.segments]
    if not stops:
        raise TcsError("The plan has no motions, so there is nothing to evaluate.")
    model = ErrorModel.of(next(iter(hands.values())).scene, errors)
    offsets = model.draw(samples, seed, stream=_STREAM)
    # Those with motions first; the others are tried for goals that are lost there.
    stops += [planned for planned in plan.stops if not planned.segments]
    places = [_Place.of(planned, hands[planned.hand]) for planned in stops]
    displacements = [
        displaced(place.hand.job, place.hand.scene, place.nominal, offsets) for place in places
    ]
    jerk = None if plan.jerk_limits is None else np.array(plan.jerk_limits)
    doing = sum(bool(planned.segments) for planned in stops)
    blind = np.zeros((samples, doing), dtype=np.bool_)
    again = np.zeros_like(blind)
    for i in range(samples):
        for number, place in enumerate(places[:doing]):
            stop = place.displaced(_sample(displacements[number], i), seed)
            blind[i, number] = _is_free(stop, place.planned)
            if not replan:
                continue
            lost = set(place.planned.goals) - place.done(stop, place.planned.goals, jerk)
            for other, elsewhere in enumerate(places):
                if lost and other != number:
                    stop = elsewhere.displaced(_sample(displacements[other], i), seed)
                    lost -= elsewhere.done(stop, sorted(lost), jerk)
            again[i, number] = not lost
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
    hand: PlanHand
    lowered: LoweredScene
    stops: StopGrid
    values: Mapping[str, float]
    """Value of each axis [m or rad]."""
    ignored: frozenset[BodyPair]
    """The base and the furniture, which may touch."""

    @classmethod
    def of(cls, planned: StopPlan, hand: PlanHand) -> _Place:
        """Lower the scene at a stop of a plan."""
        job, scene, _ = hand
        axes = job.scored_grid.axes
        values = {axis.name: value_of(planned.at, axis.name) for axis in axes}
        grid = single_grid(axes, list(values.values()))
        lowered = lower(scene, job.task, grid)
        is_person = scene.spec.environment.is_person
        furniture = [
            body for body in lowered.environment_bodies if not is_person(body.split("::")[0])
        ]
        ignored = frozenset(itertools.product(base_bodies(scene), furniture))
        stops = StopGrid.of(job, scene, grid, lowered)
        return cls(planned, hand, lowered, stops, values, ignored)

    @property
    def nominal(self) -> dict[str, float]:
        """Positions of the environment's joints without error [m or rad]."""
        return {
            axis.name: self.values[axis.name] for axis in self.stops.configurations.environment_axes
        }

    def displaced(self, state: Mapping[str, float], seed: int) -> Stop:
        """Return the stop with the environment's joints at some positions, the live scene too."""
        scene = self.hand.scene
        arrays = environment_at(self.lowered, scene, self.hand.job.task, [state])
        lowered = dataclasses.replace(self.lowered, arrays=arrays)
        stop = self.stops.with_environment(lowered).stop(0, new_trees(seed))
        stop = dataclasses.replace(stop, ignored=self.ignored)
        stop.place({**self.values, **state})
        for name, value in state.items():
            scene.set_joint(name, value)
        return stop

    def done(self, stop: Stop, goals: Sequence[int], jerk: FloatArray | None) -> set[int]:
        """Return the goals to which motions are found from the displaced stop."""
        of_hand = self.hand.goals
        served = [of_hand.index(goal) for goal in goals if goal in of_hand]
        return {of_hand[goal] for goal in plan_stop(stop, None, 0, served, jerk=jerk)[0].goals}


def _sample(displacements: tuple[Mapping[str, FloatArray], Any], i: int) -> dict[str, float]:
    """Return the positions of the environment's joints in a sample [m or rad]."""
    return {name: float(values[i]) for name, values in displacements[0].items()}


def _is_free(stop: Stop, planned: StopPlan) -> bool:
    """Return whether the motions of a stop touch nothing; virtual walls do not count."""
    return not stop.resting_contacts() and all(
        _segment_is_free(stop, segment) for segment in planned.segments
    )


def _segment_is_free(stop: Stop, segment: Segment) -> bool:
    curve = segment.curve.in_chain()
    return all(
        certified(stop.lines, stop.line_work, curve.control_points(piece)) == 1.0
        for piece in range(curve.pieces)
    )


def _figures(mean: Mean, by_stop: NDArray[np.bool_]) -> dict[str, Any]:
    return {
        "mean": mean.mean,
        "ci95": None if mean.ci95 is None else list(mean.ci95),
        "per_stop": by_stop.mean(axis=0).tolist(),
    }
