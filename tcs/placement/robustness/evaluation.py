"""Success under error: Monte-Carlo evaluation of sets of configurations."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, TcsError, UnknownNameError
from tcs.files.blocks import BlockFolder
from tcs.kernel.arrays import FloatArray
from tcs.model.random_streams import check_draws
from tcs.placement.robustness.error_model import ErrorModel, Offsets
from tcs.placement.robustness.kept_pairs import EQUAL_REACHABILITY, uniform_sets
from tcs.placement.robustness.perturbed_points import PerturbedPoints
from tcs.placement.robustness.statistics import Mean, binomial_interval, mean_of
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.store import ScoreFile, StateTables, state_to_json
from tcs.placement.tables import tc_reachability

SELECTIONS = ("best", "single", "robust", "refined", "uniform", "equal")
"""Sets to evaluate: the set with the greatest P_R + P_M; the best single configuration; the most
robust set (greatest lower confidence bound on success, estimated by `robustify`); a refined set,
the best one unless its number is given; or, as the
paper's "without TC-manipulability", another set in every sample, drawn uniformly from those whose
P_R is at least 0.98 of the greatest, as in hrl_base_selection, or equal to it, as printed."""

DONE_BY = ("motion", "approach", "posture")
"""By what a goal is done in a sample, each including those behind it: a motion from rest to its
approach and back, an approach to a posture, a posture without contact."""

Judge = Callable[..., NDArray[np.bool_]]
"""Function that returns which goals are done by motions: `tcs.motion.rooms.done_in_rooms`."""


def done_by(trials: Trials, judge: Judge | None) -> str:
    """Return by what a goal is done, one of `DONE_BY`.

    Args:
        trials: Trials of a score file. Without approach, nothing is said about motions; by the
            rules of the paper there are none.
        judge: Who judges motions; None if nobody does.
    """
    if not trials.with_approach:
        return "posture"
    return "approach" if judge is None or trials.is_paper else "motion"


_DRAWN = {"uniform": EQUAL_REACHABILITY, "equal": 1.0}
"""Selections that draw sets: the fraction of the greatest P_R that these have at least."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """Goals that a set reaches in each sample, with the settings; arrays are read-only."""

    select: str
    """One of `SELECTIONS`, or "given"."""
    sets: NDArray[np.int64]
    """Flat configuration indices of the members, shape (1, m), or (samples, m) if drawn."""
    offsets: Offsets
    """Error of each joint in each sample [m or rad], shapes (samples,)."""
    reached: NDArray[np.bool_]
    """Whether any member reaches a goal, approachably if `approach`, shape (samples, goals)."""
    done: NDArray[np.bool_]
    """Whether a goal is done from any member, shape (samples, goals)."""
    done_by: str
    """By what a goal is done, one of `DONE_BY`."""
    weights: NDArray[np.float64]
    """Weights of the goals, sum 1, shape (goals,)."""
    reachability: float
    """P_R without error; the mean over the sets if they are drawn."""
    manipulability: float
    """P_M without error; likewise."""
    choices: int
    """Number of sets to draw from; 1 unless sets are drawn."""
    clipped: int
    """Number of samples in which an error is limited at a joint limit."""
    errors: ErrorModel
    """Error model of the joints."""
    body_collisions: str
    """Collisions of the robot's body that counted, one of `BODY_COLLISIONS`."""
    approach: bool
    """Whether a goal counted as reached only by postures that can be approached, as in the file."""
    seed: int
    """Seed of the samples."""
    seconds: float
    """Duration without compilation [s]."""
    observed: Mapping[str, float]
    """Observed state of the table, by joint; angles in degrees under `..._deg` names."""
    about: Mapping[str, str]
    """Names of task, environment and robot."""
    members: tuple[dict[str, float], ...]
    """The configurations of the set as plain numbers; () if sets are drawn."""

    @cached_property
    def fractions(self) -> NDArray[np.float64]:
        """Weighted fraction of the goals done in each sample, shape (samples,)."""
        return tc_reachability(self.done, self.weights)

    @cached_property
    def summary(self) -> Mean:
        """Mean of the fractions, with standard deviation and interval."""
        return mean_of(self.fractions)

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.reached)

    @property
    def per_goal(self) -> NDArray[np.float64]:
        """Fraction of the samples in which each goal is done, shape (goals,)."""
        return np.asarray(self.done.mean(axis=0))

    @property
    def complete(self) -> float:
        """Fraction of the samples in which all goals are reached."""
        return float(self.reached.all(axis=1).mean())

    @property
    def rooms_done(self) -> float:
        """Fraction of the samples in which all goals are done."""
        return float(self.done.all(axis=1).mean())

    @property
    def rooms_done_ci95(self) -> tuple[float, float]:
        """Exact 95 % interval of `rooms_done`, by Clopper and Pearson."""
        return binomial_interval(int(np.count_nonzero(self.done.all(axis=1))), self.samples)

    def to_json(self) -> dict[str, Any]:
        """Return the figures as plain containers, as printed by `tcs evaluate --json`."""
        interval = self.summary.ci95
        return {
            **self.about,
            "select": self.select,
            "members": list(self.members),
            "choices": self.choices,
            "observed": dict(self.observed),
            "reachability": round(self.reachability, 12),
            "manipulability": round(self.manipulability, 12),
            "mean": round(self.summary.mean, 12),
            "std": self.summary.std,
            "ci95": None if interval is None else list(interval),
            "per_goal": self.per_goal.tolist(),
            "complete": self.complete,
            "rooms_done": self.rooms_done,
            "rooms_done_ci95": list(self.rooms_done_ci95),
            "done_by": self.done_by,
            "samples": self.samples,
            "seed": self.seed,
            "errors": self.errors.to_json(),
            "clipped": self.clipped,
            "body_collisions": self.body_collisions,
            "approach": self.approach,
            "seconds": self.seconds,
        }


def evaluate(
    file: ScoreFile | Trials,
    *,
    samples: int = 1000,
    seed: int = 0,
    errors: Errors = None,
    select: str | Sequence[int] = "best",
    members: int = 2,
    row: int = 0,
    table: int | None = None,
    body_collisions: str | None = None,
    stream: str = "",
    judge: Judge | None = None,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> Evaluation:
    """Return which goals are done from a set of configurations in perturbed environments.

    In each sample the joints of the error model are displaced by random errors. A goal is reached
    if any member of the set has a collision-free solution for it, that can be approached if the
    file was scored with approach. It is done if a motion leads there from rest and back as well,
    in a file with approach that was not scored as the paper does; in others, if it is reached. The
    initial configurations are unchanged; arm postures and motions are computed again. The same
    seed gives the same samples for every set.

    Args:
        file: A score file; or its trials, which is faster for repeated evaluation.
        samples: Number of samples.
        seed: Seed of the samples; results are the same for any number of jobs.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
            Not for trials, which include their errors.
        select: One of `SELECTIONS`, or flat configuration indices of the members of a set.
        members: Number of members of the sets of "uniform" and "equal", 1 or 2.
        row: Number of the set of "refined", the best first.
        table: Number of the file's table; by default the nominal one. Not for trials.
        body_collisions: Collisions of the robot's body that count, one of `BODY_COLLISIONS`; by
            default all, in a file scored as the paper does `paper`. Not for trials.
        stream: Name of the draw; another name gives independent samples.
        judge: Judges motions; `tcs.evaluate` passes `tcs.motion.rooms.done_in_rooms`. None, and for
            sets that are drawn, to count goals by their approaches. The reached goals are then not
            taken from blocks.
        jobs: Number of threads.
        blocks: Folder in which finished blocks are kept, so that the same call continues after an
            interrupt; None to keep none. Those of "refined" are not kept.
        on_progress: Called with the number of evaluated pairs of configuration and sample, and of
            all such pairs.
        on_compile: Called first if the kernel has to be compiled.

    Returns:
        Goals reached and done in each sample, with mean, standard deviation and interval.

    Raises:
        StoreMismatchError: If the file was made from other models.
        UnknownNameError: If a joint, a selection or a choice of collisions has no such name.
        DataFileError: If the error file cannot be used.
        SelectionError: If there is no set to evaluate.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.
        TcsError: If a number is out of range.

    Source:
        TCS section IV; "uniform" draws as in hrl_base_selection in
        gt-ros-pkg/hrl-assistive (BSD), 30 April 2015.
    """
    check_draws(samples, seed)
    begun = time.perf_counter()
    before = 0.0
    if isinstance(file, Trials):
        trials, before = file, file.compile_seconds
        if errors is not None or table is not None or body_collisions is not None:
            raise TcsError(
                "Trials already include errors, table and body collisions. Set them in Trials.of."
            )
    else:
        trials = Trials.of(
            file,
            errors=errors,
            table=table,
            body_collisions=body_collisions,
            on_compile=on_compile,
        )
    offsets = trials.errors.draw(samples, seed, stream=stream)
    is_drawn = isinstance(select, str) and select in _DRAWN
    refined = trials.scored.refined_set(row) if select == "refined" else None
    if refined is not None:
        sets, choices = refined.origin.astype(np.int64), 1
    else:
        sets, choices = _chosen(trials.scored, select, members, samples, seed)
    means = done_by(trials, None if is_drawn else judge)
    points = trials.points(sets[0]) if refined is None else refined.values[0]
    done = None
    with trials.kept_in(blocks) as kept:
        if is_drawn:
            # Set i is evaluated on sample i only, with all of its members.
            tiled = {name: np.tile(values, sets.shape[1]) for name, values in offsets.items()}
            found = kept.reached_each(sets.T.ravel(), tiled, jobs=jobs, on_progress=on_progress)
            found = found.reshape(sets.shape[1], samples, -1)
        elif judge is not None and means == "motion":
            found, done = _judged(trials, offsets, points, judge, seed, jobs, on_progress)
        elif refined is not None:
            found = PerturbedPoints(trials, offsets, jobs).reached(points)
        else:
            found = kept.reached(sets[0], offsets, jobs=jobs, on_progress=on_progress)
    reached: NDArray[np.bool_] = np.logical_or.reduce(found, axis=0)
    if refined is not None:
        scores = np.array([[refined.reachability[0], refined.manipulability[0]]])
        of_set = refined.members(trials.grid, 0)
    else:
        scores = np.array([trials.scored.sets.scores_of(tuple(map(int, one))) for one in sets])
        of_set = () if is_drawn else tuple(map(trials.grid.configuration, sets[0].tolist()))
    if done is None:
        done = reached
    for array in (sets, reached, done, *offsets.values()):
        array.flags.writeable = False
    return Evaluation(
        select=select if isinstance(select, str) else "given",
        sets=sets,
        offsets=offsets,
        reached=reached,
        done=done,
        done_by=means,
        weights=trials.weights,
        reachability=float(scores[:, 0].mean()),
        manipulability=float(scores[:, 1].mean()),
        choices=choices,
        clipped=trials.clipped(sets, offsets)
        if refined is None
        else trials.clipped_at(refined.values[0], offsets),
        errors=trials.errors,
        body_collisions=trials.body_collisions,
        approach=trials.with_approach,
        seed=seed,
        seconds=time.perf_counter() - begun - (trials.compile_seconds - before),
        observed=state_to_json(trials.file.observed_axes, trials.observed),
        about={
            "task": trials.job.task.name,
            "environment": trials.job.spec.environment.name,
            "robot": trials.file.robot["name"],
        },
        members=tuple(member.to_json() for member in of_set),
    )


def _judged(
    trials: Trials,
    offsets: Offsets,
    points: FloatArray,
    judge: Judge,
    seed: int,
    jobs: int,
    on_progress: Progress,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which goals points reach, shape (m, samples, goals), and which are done from any."""
    samples = PerturbedPoints(trials, offsets, jobs)
    rooms, tried = samples.samples, len(points) * samples.samples

    def report(done: int) -> None:
        if on_progress is not None:
            on_progress(done, tried + rooms)

    found = samples.scores(points, lambda done, _: report(done))
    every = np.arange(rooms)
    done = judge(
        samples, points, found, every, seed=seed, on_progress=lambda done, _: report(tried + done)
    )
    return found.reached, done


def _chosen(
    scored: StateTables, select: str | Sequence[int], members: int, samples: int, seed: int
) -> tuple[NDArray[np.int64], int]:
    """Return the sets to evaluate, shape (1, m) or (samples, m), and the number to draw from."""
    sets = scored.sets
    if not len(sets.candidates):
        raise SelectionError(
            "Nothing to evaluate: no initial configuration reaches a goal. See the reasons with "
            "`tcs explain`."
        )
    if not isinstance(select, str):
        given = np.array([int(h) for h in select], dtype=np.int64)
        # Raises an error if the indices are not a set of candidates.
        sets.scores_of(tuple(given.tolist()))
        return given[None], 1
    if select in _DRAWN:
        return uniform_sets(sets, members, samples, seed, _DRAWN[select])
    if select not in SELECTIONS:
        raise UnknownNameError("selection", select, SELECTIONS, where="evaluate")
    if select == "robust" and scored.success is None:
        raise SelectionError(
            "No success under error was estimated for this table. Estimate it first: "
            "tcs robustify FILE."
        )
    robust = scored.success.most_robust(sets) if scored.success is not None else ()
    chosen = {"best": sets.best, "single": sets.best_single, "robust": robust}[select]
    return np.array(chosen, dtype=np.int64)[None], 1
