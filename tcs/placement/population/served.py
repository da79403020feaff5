"""Which part of a population each of the best sets of a score file serves."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.files.blocks import BlockFolder
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.model.people import Bodies, scales_of_people
from tcs.placement.population.differences import Difference, Part, ranking, tree
from tcs.placement.population.outcomes import Reasons, for_papers_man, reasons_for_people
from tcs.placement.robustness.statistics import binomial_interval, mean_of
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.selection import Choice, Top, TravelWeights, UtilityWeights, select
from tcs.placement.store import APPROACH, ScoreFile, state_to_json
from tcs.placement.tables import Reason, tc_reachability

STREAM = "population"
"""Name of the random stream of the errors, one sample for each person."""
SHOWN_MEASURES = 5
"""Number of measures in the ranking of the JSON."""
_BEST = Top(count=10)


@dataclass(frozen=True, eq=False)
class SetForPeople:
    """What one set reaches for each of N people."""

    indices: tuple[int, ...]
    """Flat configuration indices of its members."""
    members: tuple[dict[str, float], ...]
    """The same as plain numbers."""
    reachability: float
    """P_R for the person of the score file."""
    manipulability: float
    """P_M for that person."""
    expected: BoolArray
    """Whether it reaches each goal for that person, shape (goals,)."""
    reached: BoolArray
    """Whether it reaches each goal for each person, shape (N, goals)."""
    weights: FloatArray
    """Weights of the goals, sum 1, shape (goals,)."""

    @cached_property
    def served(self) -> BoolArray:
        """Whether all goals are reached, for each person, shape (N,)."""
        return np.asarray(self.reached.all(axis=1))

    @cached_property
    def as_scored(self) -> BoolArray:
        """Whether every goal is reached that is reached for the person of the score file, (N,)."""
        return np.asarray(self.reached[:, self.expected].all(axis=1))

    @cached_property
    def fractions(self) -> FloatArray:
        """Weighted fraction of the goals reached for each person, shape (N,)."""
        return tc_reachability(self.reached, self.weights)

    def to_json(self) -> dict[str, Any]:
        """Return the figures as plain containers."""
        mean = mean_of(self.fractions)
        return {
            "members": list(self.members),
            "reachability": round(self.reachability, 12),
            "manipulability": round(self.manipulability, 12),
            **fraction_of(self.served),
            "served_as_scored": float(self.as_scored.mean()),
            "mean": round(mean.mean, 12),
            "mean_ci95": None if mean.ci95 is None else list(mean.ci95),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Population:
    """Which of N people each of K sets serves; arrays are read-only."""

    people: Bodies
    """The people."""
    sets: tuple[SetForPeople, ...]
    """The sets, that with the greatest P_R + P_M first."""
    blocked: BoolArray
    """Whether the gripper at a goal touches the environment, e.g. the person, in every state of the
    environment that the sets use, so that no base pose reaches it, shape (N, goals)."""
    goal_names: tuple[str, ...]
    """Where each goal is, as people say it; "" for a goal without a name."""
    observed: Mapping[str, float]
    """Observed state of the table; angles in degrees under `..._deg` names."""
    about: Mapping[str, str]
    """Names of task, environment and robot."""
    without_approach: bool
    """Whether the file was scored with approach: for people a goal counts as reached by any posture
    nevertheless."""
    errors: Mapping[str, Any] | None
    """Distributions of the joints' errors, None without errors."""
    seed: int
    """Seed of the errors."""
    seconds: float
    """Duration without compilation [s]."""

    @property
    def best(self) -> SetForPeople:
        """The set with the greatest P_R + P_M."""
        return self.sets[0]

    @cached_property
    def most(self) -> int:
        """Number of the set that serves most people; of equals that with the greater mean."""
        key = [(int(one.served.sum()), float(one.fractions.mean())) for one in self.sets]
        return max(range(len(self.sets)), key=lambda i: (*key[i], -i))

    @cached_property
    def two(self) -> tuple[int, int] | None:
        """Numbers of the two sets that together serve most, over all pairs; None for one set.

        A person is served by two sets if either serves them.
        """
        served = np.array([one.served for one in self.sets])
        pairs = list(itertools.combinations(range(len(self.sets)), 2))
        if not pairs:
            return None
        return max(pairs, key=lambda p: (int((served[p[0]] | served[p[1]]).sum()), -p[0], -p[1]))

    @cached_property
    def served_by_two(self) -> BoolArray | None:
        """Whether either of these two sets serves each person, shape (N,); None for one set."""
        if self.two is None:
            return None
        first, second = self.two
        return self.sets[first].served | self.sets[second].served

    @property
    def is_complete(self) -> bool:
        """Whether the best set reaches all goals for the person of the score file."""
        return bool(self.best.expected.all())

    @property
    def kept(self) -> BoolArray:
        """Whether the best set serves each person; if it is not complete, as it was scored."""
        return self.best.served if self.is_complete else self.best.as_scored

    @cached_property
    def differences(self) -> tuple[Difference, ...]:
        """The measures that tell the people who are served from the others, the best first."""
        return ranking(self.people, self.kept)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The people by limits of two measures, the least served first."""
        return tree(self.people, self.kept)

    def to_json(self) -> dict[str, Any]:
        """Return the figures as plain containers, as printed by `tcs population --json`."""
        best = self.best.to_json()
        return {
            **self.about,
            "bodies": len(self.people),
            "women": int(np.count_nonzero(~self.people.is_male)),
            "observed": dict(self.observed),
            "served": best["served"],
            "ci95": best["ci95"],
            "served_as_scored": best["served_as_scored"],
            "mean": best["mean"],
            "sets": [one.to_json() for one in self.sets],
            "serves_most": self.most,
            "two_sets": self._two_to_json(),
            "not_served": self._not_served_to_json(),
            "without_approach": self.without_approach,
            "errors": self.errors,
            "seed": self.seed,
            "seconds": self.seconds,
        }

    def _two_to_json(self) -> dict[str, Any] | None:
        if self.two is None or self.served_by_two is None:
            return None
        return {"sets": list(self.two), **fraction_of(self.served_by_two)}

    def _not_served_to_json(self) -> dict[str, Any]:
        lost = ~self.best.reached
        goals = np.flatnonzero(lost.any(axis=0))
        return {
            "bodies": int(np.count_nonzero(~self.kept)),
            "numbers": np.flatnonzero(~self.kept).tolist(),
            "criterion": "all goals" if self.is_complete else "goals as scored",
            "measures": [one.to_json() for one in self.differences[:SHOWN_MEASURES]],
            "parts": [part.to_json() for part in self.parts],
            "goals": [
                {
                    "goal": int(goal),
                    "name": self.goal_names[goal],
                    "not_reached": float(lost[:, goal].mean()),
                    "gripper_touches": float(self.blocked[:, goal].mean()),
                }
                for goal in goals[np.argsort(-lost.mean(axis=0)[goals], kind="stable")]
            ],
        }


def fraction_of(served: BoolArray) -> dict[str, Any]:
    """Return the fraction of the people who are served, with its exact 95 % interval."""
    low, high = binomial_interval(int(np.count_nonzero(served)), served.size)
    return {"served": float(served.mean()), "ci95": [low, high]}


def population(
    file: ScoreFile,
    people: Bodies,
    *,
    top: Top = _BEST,
    errors: Errors | bool = False,
    seed: int = 0,
    table: int | None = None,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> Population:
    """Return which part of a population each of the best sets of a score file serves.

    Each person takes the place of the one in the environment: shapes, seat and goals are those of
    their body. Each member of the sets is scored for each person as `tcs.score` scores it, without
    approach; nothing else on the grid is. A set serves a person if its members reach all goals of
    the task.

    Args:
        file: A score file.
        people: The people, as by `tcs.model.people.draw_bodies` or `load_people`.
        top: Number of sets and how far apart they are; the sets are those that `tcs.select` offers,
            in the order of P_R + P_M.
        errors: True to displace the joints of the environment by random errors, as `tcs.evaluate`
            does, one sample for each person; path of an error file or errors by joint for other
            errors than those of the environment.
        seed: Seed of these errors.
        table: Number of the file's table; by default the nominal one.
        jobs: Number of threads; the result does not depend on it.
        blocks: Folder in which finished blocks are kept, so that the same call continues after an
            interrupt; None to keep none.
        on_progress: Called with the number of people done and of all.
        on_compile: Called first if the kernel has to be compiled.

    Returns:
        The sets with the goals that they reach for each person.

    Raises:
        StoreMismatchError: If the file was made from other models.
        EnvironmentFileError: If there is no person in the environment who can be resized.
        DataFileError: If the measures of a person contradict each other, or the error file cannot
            be used.
        SelectionError: If there is no set, or no such table.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.
        TcsError: If a number is out of range.
    """
    begun = time.perf_counter()
    is_perturbed = errors is not False
    trials = Trials.of(
        file,
        errors=None if isinstance(errors, bool) else errors,
        table=table,
        body_collisions=None if is_perturbed else "all",
        on_compile=on_compile,
    )
    trials = for_papers_man(trials)
    choices = _best_sets(file, trials, top)
    offsets = trials.errors.draw(len(people), seed, stream=STREAM) if is_perturbed else None
    members = np.unique(np.concatenate([choice.indices for choice in choices]))
    with trials.kept_in(blocks) as kept:
        reasons = reasons_for_people(
            kept, members, scales_of_people(people), offsets, jobs=jobs, on_progress=on_progress
        )
    blocked = np.asarray((reasons == Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT).all(axis=0))
    sets = tuple(_set_for_people(choice, members, reasons, trials) for choice in choices)
    return Population(
        people=people,
        sets=sets,
        blocked=blocked,
        goal_names=tuple(goal.name for goal in trials.task.goals),
        observed=state_to_json(file.observed_axes, trials.observed),
        about={
            "task": trials.job.task.name,
            "environment": trials.job.spec.environment.name,
            "robot": trials.file.robot["name"],
        },
        without_approach=APPROACH in file.metadata,
        errors=trials.errors.to_json() if is_perturbed else None,
        seed=seed,
        seconds=time.perf_counter() - begun - trials.compile_seconds,
    )


def _best_sets(file: ScoreFile, trials: Trials, top: Top) -> Sequence[Choice]:
    """Return the sets with the greatest P_R + P_M, regardless of where the robot is."""
    candidates = trials.scored.sets.candidates
    if not len(candidates):
        raise SelectionError(
            "No initial configuration reaches a goal, so there is no set. See the reasons with "
            "`tcs explain`."
        )
    best = select(
        file,
        file.configurations.configuration(int(candidates[0])),
        weights=UtilityWeights(travel=0.0, places=0.0, environment=0.0),
        travel=TravelWeights(route="straight"),
        top=top,
        observed=trials.observed,
    )
    return (best, *best.alternatives)


def _set_for_people(
    choice: Choice, members: IntArray, reasons: Reasons, trials: Trials
) -> SetForPeople:
    """Return what a set reaches for each person, given the reasons for all members of sets."""
    rows = np.searchsorted(members, choice.indices)
    reached = np.asarray((reasons[rows] == Reason.REACHED).any(axis=0))
    reached.flags.writeable = False
    sets = trials.scored.sets
    candidates = np.searchsorted(sets.candidates, choice.indices)
    expected = np.logical_or.reduce(sets.reached[candidates], axis=0)
    return SetForPeople(
        indices=choice.indices,
        members=tuple(member.to_json() for member in choice.members),
        reachability=choice.reachability,
        manipulability=choice.manipulability,
        expected=expected,
        reached=reached,
        weights=trials.weights,
    )
