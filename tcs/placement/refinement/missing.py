"""What is missing for a goal that no configuration reaches, and what would give it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray, SceneArrays, poses_of
from tcs.kernel.freedom.forms import AXIS, COLUMNS, FOLD, TILT
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tcs.model.scene import LoweredScene
from tcs.placement.reasons.distribution import CHECKS
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.store import APPROACH, ScoreFile
from tcs.placement.tables import Reason, ScoreTable

MOST_ROWS = 400
"""Most configurations at which changes are tried, those that passed the most checks: a change that
reaches the goal from one in twenty of them is all but sure to be found (a chance of 1e-9)."""
SHIFTS = (0.01, 0.02, 0.04, 0.08, 0.16)
"""Displacements that are tried in turn [m]: seats and beds are set by no more."""
TILTS = tuple(math.radians(deg) for deg in (5.0, 10.0, 20.0, 40.0, 80.0))
"""Additional tilts that are tried in turn [rad], up to a direction across the nominal one."""
WIDEST = math.radians(170.0)
"""Greatest tilt of an axis that is tried [rad]; 180 degrees would free every orientation."""
SHIFT_STEP, TILT_STEP = 0.001, math.radians(0.5)
"""Resolution of the amounts [m and rad]: a millimetre and half a degree are less than furniture
and people can be set by."""


@dataclass(frozen=True, slots=True)
class Remedy:
    """A change of a goal with which a configuration of the grid reaches it."""

    change: str
    """What changes: "lower", "higher" and "back" (away along the tool's x) move the goal, "tilt"
    lets the tool tilt further."""
    amount: float
    """The least amount that was found to suffice [m or rad]."""

    @property
    def words(self) -> str:
        """The change as the end of a sentence that begins "It would be reached"."""
        if self.change == "tilt":
            return f"with the tool tilted by {math.degrees(self.amount):.3g} degrees more"
        where = "farther from the skin" if self.change == "back" else self.change
        return f"{100.0 * self.amount:.3g} cm {where}"

    def to_json(self) -> dict[str, Any]:
        """Return the change as plain containers, with its unit."""
        is_angle = self.change == "tilt"
        amount = math.degrees(self.amount) if is_angle else self.amount
        return {
            "change": self.change,
            "amount": round(amount, 6),
            "unit": "deg" if is_angle else "m",
            "words": self.words,
        }


def what_is_missing(
    file: ScoreFile,
    goal: int,
    table: int | None = None,
    *,
    on_compile: Callable[[], None] | None = None,
) -> tuple[Remedy, ...]:
    """Return changes of a goal, each of which by itself makes a configuration reach it.

    The goal is moved, or the tool may tilt further about the axis of its freedom (x if there is
    none); person, furniture and grid stay as they are. The change is scored like any goal, with
    approach if the file is, at configurations that passed the most checks. Other configurations may
    need less. Nothing is returned for a goal that is reached, or that two arms reach at once.

    Args:
        file: A score file.
        goal: Number of the goal, from 0.
        table: Number of the file's table; by default the nominal one.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the file was made from other models.
        DataFileError: If a file that it names cannot be used.
    """
    number = file.nominal_index if table is None else table
    scores = file.tables[number].scores
    at = _tried(scores, goal)
    if scores.reached[:, goal].any() or not at.size:
        return ()
    first = number * file.configurations.size
    found: dict[str, float] = {}
    for (job, _, lowered), goals in zip(rebuild_scenes(file), file.goals_of_hands, strict=True):
        if goal not in goals or job.hand.other is not None:
            continue
        trial = _Trial(job, lowered, goals.index(goal), at + first, file, on_compile)
        for change, amount in trial.remedies():
            found[change] = min(amount, found.get(change, math.inf))
    return tuple(Remedy(change, amount) for change, amount in found.items())


def _tried(scores: ScoreTable, goal: int) -> IntArray:
    """Return up to `MOST_ROWS` configurations that passed the most checks, spread evenly."""
    reason = scores.reason[:, goal]
    chosen: list[IntArray] = []
    left = MOST_ROWS
    for check in reversed(CHECKS):
        if check in (Reason.BODY_BLOCKED, Reason.EXCLUDED) or not left:
            continue
        rows = np.flatnonzero(reason == check)
        if rows.size > left:
            rows = rows[np.linspace(0, rows.size - 1, left).astype(np.int64)]
        chosen.append(rows)
        left -= rows.size
    return np.sort(np.concatenate(chosen))


class _Trial:
    """One goal of one hand, scored after changes."""

    def __init__(
        self,
        job: Job,
        lowered: LoweredScene,
        goal: int,
        rows: IntArray,
        file: ScoreFile,
        on_compile: Callable[[], None] | None,
    ) -> None:
        """Keep the arrays of the goal alone, the rows and how files are scored."""
        self._arrays = _of_goal(lowered.arrays, goal)
        self._rows = rows_at(lowered.grid, rows)
        self._measure = str(file.metadata["measure"])
        self._lines = None
        if APPROACH in file.metadata:
            lines = approach_lines(job)
            self._lines = type(lines)(*(values[goal : goal + 1] for values in lines))
        self._on_compile = on_compile

    def remedies(self) -> Iterator[tuple[str, float]]:
        """Yield the changes that suffice, with their amounts [m or rad]."""
        arrays = self._arrays
        up = np.array([0.0, 0.0, 1.0])
        directions = {"lower": -up, "higher": up, "back": -arrays.goal_R[..., 0]}
        for change, direction in directions.items():
            amount = self._least(partial(_moved, arrays, direction), SHIFTS, SHIFT_STEP)
            if amount is not None:
                yield change, amount
        amount = self._least(partial(_tilting, arrays), TILTS, TILT_STEP)
        if amount is not None:
            yield "tilt", amount

    def _least(
        self, changed: Callable[[float], SceneArrays], amounts: tuple[float, ...], step: float
    ) -> float | None:
        """Return the least amount found to suffice, in multiples of a step; None if none does."""
        low = 0.0
        for high in amounts:
            if self._is_reached(changed(high)):
                break
            low = high
        else:
            return None
        while high - low > 1.5 * step:
            middle = step * round(0.5 * (low + high) / step)
            if self._is_reached(changed(middle)):
                high = middle
            else:
                low = middle
        return high

    def _is_reached(self, arrays: SceneArrays) -> bool:
        """Return whether any of the configurations reaches the goal."""
        problem = build_problem(arrays, self._measure)
        approaches = None if self._lines is None else ApproachScorer(problem, self._lines)
        warm_up(problem, self._on_compile, approaches)
        scores = Scorer.of(problem, approaches).score(self._rows)
        return bool(np.any(scores.reason == REACHED))


def _of_goal(arrays: SceneArrays, goal: int) -> SceneArrays:
    """Return a scene with one of its goals."""
    poses = list(poses_of(arrays.first_pose, goal))
    return arrays._replace(
        goal_R=arrays.goal_R[:, poses],
        goal_p=arrays.goal_p[:, poses],
        freedom=_freedom(arrays)[poses],
        first_pose=np.array([0, len(poses)] if len(poses) > 1 else [], np.int64),
    )


def _freedom(arrays: SceneArrays) -> FloatArray:
    """Return the freedom of all poses, shape (poses, COLUMNS): zeros of those without."""
    return arrays.freedom if len(arrays.freedom) else np.zeros((arrays.goal_p.shape[1], COLUMNS))


def _moved(arrays: SceneArrays, direction: FloatArray, distance: float) -> SceneArrays:
    """Return a scene whose goals are moved in W by a distance [m] along unit vectors."""
    return arrays._replace(goal_p=arrays.goal_p + distance * direction)


def _tilting(arrays: SceneArrays, angle: float) -> SceneArrays:
    """Return a scene whose goals let the tool tilt further, by an angle [rad]."""
    freedom: NDArray[np.float64] = arrays.freedom.copy()
    tilt = freedom[:, TILT]
    freedom[:, TILT] = np.where(tilt < WIDEST, np.minimum(tilt + angle, WIDEST), tilt)
    no_axis = ~freedom[:, AXIS : AXIS + 3].any(axis=1)
    freedom[no_axis, AXIS], freedom[no_axis, FOLD] = 1.0, 1.0
    return arrays._replace(freedom=freedom)
