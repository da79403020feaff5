"""What the report of one score file is about: the set it answers with, checked and drawn."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from tcs.model.grid import InitialConfiguration
from tcs.output.draw import as_png
from tcs.output.report.pictures import map_figure, member_figure, scored_scene
from tcs.output.report.shown_set import ShownSet
from tcs.output.report.states import has_states, states_figure
from tcs.output.words import assign_goals
from tcs.placement.reasons import Distribution, Explanation, explain
from tcs.placement.scoring import Job, Verification, verify
from tcs.placement.scoring.verify import DEXTERITY_BAR, Finding, check_pairs
from tcs.placement.store import ScoreFile, StateTables, load_scores
from tcs.placement.tables import Reason, SuccessTable

_DPI = 110
"""Of pictures in the page: sharp at the width of a page, also for who reads it twice as large."""


@dataclass(frozen=True, slots=True)
class CheckSizes:
    """How much of a file is re-checked."""

    pairs: int = 500
    """Reached pairs that Drake checks again."""
    dense: int = 200
    """Unreached and reached pairs that are scanned densely."""
    seed: int = 0


@dataclass(frozen=True, slots=True)
class GoalResult:
    """What came of one member of the set at one goal."""

    reason: Reason
    pair: tuple[str, str] | None
    """The two bodies that block, if any do."""
    measure: float
    """The dexterity measure of the stored posture, 0 where the goal is not reached."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreReport:
    """A score file's report, and everything the report tells about it."""

    path: Path
    """Where the file is."""
    sha256: str
    """Of the file."""
    file: ScoreFile
    job: Job
    """What it was scored from."""
    shown: ShownSet
    """The set that the report is about."""
    max_members: int | None
    """Most members that it was to have, if that was asked for."""
    verification: Verification
    """What re-checking random pairs of the file found."""
    findings: Mapping[int, Finding]
    """What Drake says of the very postures that the report shows, by goal."""
    check: CheckSizes
    map: bytes
    """From above, PNG."""
    states: bytes | None
    """From above for each state of the environment, PNG; None where there is one only."""
    views: tuple[bytes, ...]
    """Each member, and the tool at a goal from nearby, PNG."""
    seconds: float
    """How long all of this took, wall clock."""

    @property
    def scored(self) -> StateTables:
        """The table that the set is of."""
        return self.file.tables[self.shown.table]

    @property
    def goals(self) -> int:
        """How many goals there are."""
        return self.scored.scores.goals

    @property
    def measure(self) -> str:
        """Name of the dexterity measure."""
        return str(self.file.metadata["measure"])

    @property
    def scores(self) -> tuple[float, float]:
        """P_R and P_M of the set; zeros where it has no member."""
        if not self.shown.indices:
            return (0.0, 0.0)
        return self.scored.sets.scores_of(tuple(sorted(self.shown.indices)))

    @property
    def success(self) -> SuccessTable | None:
        """Estimates of success, where the file holds any for this table."""
        return self.scored.success

    @cached_property
    def results(self) -> tuple[tuple[GoalResult, ...], ...]:
        """What came of each member, at each goal."""
        scores = self.scored.scores
        return tuple(
            tuple(
                GoalResult(
                    reason=Reason(scores.reason[h, g]),
                    pair=scores.pair_names[scores.pair[h, g]] if scores.pair[h, g] >= 0 else None,
                    measure=float(scores.dexterity[h, g]),
                )
                for g in range(self.goals)
            )
            for h in self.shown.indices
        )

    @property
    def is_sound(self) -> bool:
        """Whether no answer was found false, of the file or of those shown."""
        return self.verification.is_sound and all(map(self.is_confirmed, self.findings))

    def is_confirmed(self, goal: int) -> bool:
        """Return whether Drake confirms the posture shown at a goal, and its measure."""
        finding = self.findings[goal]
        return finding.is_true and finding.dexterity_error <= DEXTERITY_BAR

    @cached_property
    def assignment(self) -> tuple[int | None, ...]:
        """Number of the member that serves each goal, from 0; None where no member reaches it."""
        return assign_goals(self.scored.scores, self.shown.indices)

    @cached_property
    def distributions(self) -> tuple[Distribution, ...]:
        """For each goal, how the reasons are spread over the grid."""
        return tuple(Distribution.of(self.scored.scores, goal) for goal in range(self.goals))

    @property
    def unreached(self) -> tuple[int, ...]:
        """The goals that no member reaches."""
        return tuple(goal for goal, number in enumerate(self.assignment) if number is None)

    def explanation(self, goal: int) -> Explanation:
        """Return what would have to change for the set to reach a goal."""
        from_where = self.shown.indices[0] if self.shown.indices else None
        observed = self.file.observed_states[self.shown.table]
        return explain(self.file, goal, from_where, observed=observed or None)


def score_report(
    path: Path,
    *,
    here: InitialConfiguration | None = None,
    max_members: int | None = None,
    observed: Mapping[str, float] | None = None,
    check: CheckSizes | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> ScoreReport:
    """Return a score file's report, re-checked with Drake and drawn.

    Args:
        path: A score file.
        here: Where the robot is now; without it, the set with the best scores is shown.
        max_members: Most members of the set; by default as many as the file holds.
        observed: How the person is found: values of the observed axes [m or rad].
        check: How much to re-check.
        on_progress: Called with re-checked pairs done and in all.

    Raises:
        StoreError: If the file cannot be used, or is not of today's models.
        SelectionError: If no such set can be chosen.
    """
    begun, check = time.perf_counter(), check or CheckSizes()
    file = load_scores(path)
    shown = ShownSet.of(file, here, max_members, observed)
    scored = scored_scene(file, shown)
    served = {
        goal: shown.indices[number]
        for goal, number in enumerate(assign_goals(file.tables[shown.table].scores, shown.indices))
        if number is not None
    }
    findings = check_pairs(file, shown.table, [(h, goal) for goal, h in served.items()])
    return ScoreReport(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        file=file,
        job=scored.job,
        shown=shown,
        max_members=max_members,
        verification=verify(
            file, pairs=check.pairs, dense=check.dense, seed=check.seed, on_progress=on_progress
        ),
        findings=dict(zip(served, findings, strict=True)),
        check=check,
        map=as_png(map_figure(file, shown, scored), _DPI, colours=None),
        states=as_png(states_figure(file, shown, scored=scored), _DPI, colours=None)
        if has_states(file)
        else None,
        views=tuple(
            as_png(member_figure(file, shown, number, scored), _DPI)
            for number in range(len(shown.members))
        ),
        seconds=time.perf_counter() - begun,
    )
