"""Plans under error: whether motions stay free of contact where the person lies or sits off."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.search_trees import new_trees
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import single_row
from tcs.model.scene import lower
from tcs.motion.motion_plan import MotionPlan, Segment, StopPlan
from tcs.motion.plan_check import hands_of
from tcs.motion.plans import value_of
from tcs.motion.rooms import done_in_rooms, in_rooms
from tcs.motion.stops import BodyPair, Stop, StopGrid, single_grid
from tcs.placement.robustness import ErrorModel, Mean, PerturbedPoints, mean_of
from tcs.placement.robustness.body_collisions import counted_pairs, default_collisions
from tcs.placement.robustness.error_model import Offsets, displaced
from tcs.placement.robustness.statistics import binomial_interval
from tcs.placement.robustness.trials import Errors, HandTrials, Progress, counter
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.scoring.kernel_start import KernelStart
from tcs.placement.scoring.together import Hands

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
    done: NDArray[np.bool_] | None
    """Whether each goal of the task is done from any stop, shape (samples, goals)."""
    body_collisions: str
    """Collisions of the robot's body that counted, one of `BODY_COLLISIONS`."""
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
        again, rooms = None, {}
        if self.done_again is not None and self.replanned is not None and self.done is not None:
            again = _figures(self.done_again, self.replanned)
            complete = np.asarray(self.done.all(axis=1))
            interval = binomial_interval(int(np.count_nonzero(complete)), len(complete))
            rooms = {"rooms_done": float(complete.mean()), "rooms_done_ci95": list(interval)}
        return {
            "blind": _figures(self.free, self.blind),
            "replanned": again,
            **rooms,
            "body_collisions": self.body_collisions,
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
    jobs: int = 2,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> PlanSuccess:
    """Return whether the motions of a plan stay free when the environment is perturbed.

    In each sample the joints of the error model are displaced by random errors, as `evaluate` does.
    The motions are played as planned, without knowledge of the errors, and must keep the distances
    that scoring requires; and motions to all goals, which move with the person, are planned anew
    with knowledge of them, from any stop of the plan, as `tcs.evaluate` does for a set. The base
    stands where planned. Its contacts with the furniture count as in `tcs.evaluate`.

    Args:
        plan: The plan, e.g. from `load_plan`.
        samples: Number of samples.
        seed: Seed of the samples and of the planner.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
        replan: Whether motions are planned anew.
        jobs: Number of threads; the result does not depend on it.
        on_progress: Called with the number of steps done and in all.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the models have changed since the plan was made.
        StoreFormatError: If it names goals, joints or axes that its scene does not have.
        TcsError: If the plan has no motion, no joint has an error, or a number is out of range.
    """
    begun = time.perf_counter()
    if not any(planned.segments for planned in plan.stops):
        raise TcsError("The plan has no motions, so there is nothing to evaluate.")
    tried = _PlanTried.of(plan, on_compile)
    model = ErrorModel.of(tried.hands[0].scene, errors)
    offsets = model.draw(samples, seed, stream=_STREAM)
    # Those with motions first.
    stops = sorted(plan.stops, key=lambda planned: not planned.segments)
    doing = sum(bool(planned.segments) for planned in stops)
    rooms = PerturbedPoints(tried, offsets, jobs)
    places = [_Place.of(planned, rooms) for planned in stops]
    points = np.unique([list(place.values.values()) for place in places], axis=0)
    steps = (1 + replan * (1 + len(points))) * samples

    def report(before: int) -> Progress:
        return lambda done, _: on_progress(before + done, steps) if on_progress else None

    step = counter(samples, report(0))
    blind = np.zeros((samples, doing), dtype=np.bool_)
    for i in range(samples):
        for number, place in enumerate(places[:doing]):
            blind[i, number] = place.is_free(i)
        step(1)
    again = done = None
    if replan:
        found = rooms.scores(points, report(samples))
        every, before = np.arange(samples), (1 + len(points)) * samples
        done = done_in_rooms(rooms, points, found, every, seed=seed, on_progress=report(before))
        again = np.stack([done[:, list(one.goals)].all(axis=1) for one in stops[:doing]], axis=1)
    limited = np.any([place.clipped(offsets) for place in places], axis=0)
    return PlanSuccess(
        blind=blind,
        replanned=again,
        done=done,
        body_collisions=tried.body_collisions,
        clipped=int(np.count_nonzero(limited)),
        errors=model,
        seed=seed,
        seconds=time.perf_counter() - begun,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _PlanTried:
    """The hands of a plan, prepared for trials in perturbed environments."""

    hands: tuple[HandTrials, ...]
    start: KernelStart
    body_collisions: str
    measure: str = DEFAULT_MEASURE
    observed: Mapping[str, float] = field(default_factory=dict)
    together: Hands | None = None

    @classmethod
    def of(cls, plan: MotionPlan, on_compile: Callable[[], None] | None) -> _PlanTried:
        """Build the scene of a plan."""
        collisions = default_collisions(plan.made_from)
        found = hands_of(plan)
        hands = []
        for job, scene, goals in found.values():
            axes = job.scored_grid.axes
            lowered = lower(scene, job.task, single_grid(axes, [axis.value(0) for axis in axes]))
            pairs = counted_pairs(scene, lowered, collisions)
            lines = approach_lines(job)
            hands.append(HandTrials(job, scene, lowered, pairs, goals, lines))
        start = KernelStart(
            lambda: (build_problem(hand.lowered.arrays) for hand in hands),
            on_compile,
            hands[0].approaches,
        )
        return cls(hands=tuple(hands), start=start, body_collisions=collisions)

    @property
    def goals(self) -> int:
        """Number of goals of the task."""
        return 1 + max(goal for hand in self.hands for goal in hand.goals)

    @property
    def environment_axes(self) -> tuple[str, ...]:
        """Names of all axes that are the environment's, the observed ones too."""
        return tuple(axis.name for axis in self.hands[0].job.scored_grid.environment_axes)


@dataclass(frozen=True, eq=False)
class _Place:
    """A stop of a plan in all rooms."""

    planned: StopPlan
    hand: HandTrials
    values: Mapping[str, float]
    """Value of each axis without error [m or rad]."""
    positions: Mapping[str, FloatArray]
    """Positions of the environment's joints in the rooms [m or rad], shapes (samples,)."""
    grid: StopGrid
    """The stop; its states of the environment are the rooms."""
    uncounted: frozenset[BodyPair]
    """Pairs of bodies of the robot and of the environment whose contact does not count."""

    @classmethod
    def of(cls, planned: StopPlan, rooms: PerturbedPoints) -> _Place:
        """Prepare a stop of a plan."""
        tried = rooms.trials
        hand = next(one for one in tried.hands if planned.hand in ("", one.job.hand.name))
        axes = hand.job.scored_grid.axes
        values = {axis.name: value_of(planned.at, axis.name) for axis in axes}
        state = {name: values[name] for name in tried.environment_axes}
        arrays, lowered = hand.lowered.arrays, hand.lowered
        left_out = np.argwhere(arrays.body_vs_environment & ~hand.body_pairs)
        uncounted = frozenset(
            (
                lowered.robot_bodies[arrays.body.body[i]],
                lowered.environment_bodies[arrays.environment.body[j]],
            )
            for i, j in left_out
        )
        grid = in_rooms(rooms, hand, state, np.array([values["torso"]]))
        return cls(planned, hand, values, rooms.positions(hand, state), grid, uncounted)

    def clipped(self, offsets: Offsets) -> BoolArray:
        """Return in which rooms an error is limited at a joint limit, shape (samples,)."""
        job, scene = self.hand.job, self.hand.scene
        names = [axis.name for axis in job.scored_grid.environment_axes]
        return displaced(job, scene, {name: self.values[name] for name in names}, offsets)[1]

    def is_free(self, room: int) -> bool:
        """Return whether the motions touch nothing in a room; virtual walls do not count."""
        stop = self.stop_in(room)
        return not self.resting_contacts() and all(
            _segment_is_free(stop, segment) for segment in self.planned.segments
        )

    def stop_in(self, room: int) -> Stop:
        """Return the stop in a room; the live scene is set to it too."""
        scene, values = self.hand.scene, self.values
        base = (values[name] for name in ("base_x", "base_y", "base_yaw"))
        stop = self.grid.stop_at(single_row(*base, state=room), new_trees(0), {})
        state = {name: float(at[room]) for name, at in self.positions.items()}
        stop.place({**values, **state})
        for name, value in state.items():
            scene.set_joint(name, value)
        return stop

    def resting_contacts(self) -> list[BodyPair]:
        """Return the bodies that Drake finds in contact in the live scene, where that counts."""
        found = [pair[:2] for pair in self.hand.scene.violations()]
        return [pair for pair in found if pair not in self.uncounted]


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
