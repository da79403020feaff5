"""The report of one score file: a set of it, verified and drawn."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from tcs.model.grid import InitialConfiguration
from tcs.motion import plan
from tcs.output.draw import as_png
from tcs.output.report.score.pictures import map_figure, member_figure
from tcs.output.report.score.shown_set import ScoredScene, ShownSet, scored_scenes
from tcs.output.report.score.states import has_states, states_figure
from tcs.output.report.score.tours import Tours
from tcs.output.words import assign_goals
from tcs.placement.reasons import Distribution, Explanation, explain
from tcs.placement.scoring import Job, Verification, verify
from tcs.placement.scoring.drake_check import DEXTERITY_BAR, Finding
from tcs.placement.scoring.verify import check_pairs, check_refined
from tcs.placement.store import ScoreFile, StateTables, load_scores
from tcs.placement.tables import Reason, SuccessTable

_DPI = 110
"""Resolution of pictures: sharp on a page that is shown at twice its size."""


@dataclass(frozen=True, slots=True)
class CheckSizes:
    """How many pairs of a file are verified."""

    pairs: int = 500
    """Number of reached pairs that Drake re-checks."""
    dense: int = 200
    """Number of pairs, unreached and reached, that are scanned densely."""
    seed: int = 0
    """Seed of the random draw."""


@dataclass(frozen=True, slots=True)
class GoalResult:
    """The result of one member of the set at one goal."""

    reason: Reason
    pair: tuple[str, str] | None
    """The bodies in contact, if a contact is the reason."""
    measure: float
    """Dexterity of the stored posture, 0 if the goal is not reached."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreReport:
    """A score file, the set that is reported, and the results of checking both."""

    path: Path
    """Path of the score file."""
    sha256: str
    """SHA-256 of the file."""
    file: ScoreFile
    job: Job
    """The models and the task that were scored."""
    shown: ShownSet
    """The set that is reported."""
    max_members: int | None
    """Most members requested; None for as many as the file holds."""
    verification: Verification
    """Verification of random pairs of the file."""
    findings: Mapping[int, Finding]
    """Drake's findings on the postures that the report shows, by goal."""
    sizes: CheckSizes
    """How many pairs were verified."""
    map: bytes
    """Map, PNG."""
    states: bytes | None
    """Map of each state of the environment, PNG; None if there is one state only."""
    views: tuple[bytes, ...]
    """Each member, with a close view of the tool at a goal, PNG."""
    tours: Tours | None
    """The motions of the set; None if none were requested."""
    seconds: float
    """Wall time to make the report."""

    @property
    def scored(self) -> StateTables:
        """The state table that holds the set."""
        return self.file.tables[self.shown.table]

    @property
    def goals(self) -> int:
        """Number of goals."""
        return self.scored.scores.goals

    @property
    def measure(self) -> str:
        """Name of the dexterity measure."""
        return str(self.file.metadata["measure"])

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Where each goal is, as people say it; "" where the file does not state it."""
        return self.shown.goal_names

    @property
    def scores(self) -> tuple[float, float]:
        """P_R and P_M of the set; zeros if it has no member."""
        return self.shown.reachability, self.shown.manipulability

    @property
    def success(self) -> SuccessTable | None:
        """Estimated success under error, if the file holds estimates for this table."""
        return self.scored.success

    @cached_property
    def results(self) -> tuple[tuple[GoalResult, ...], ...]:
        """The result of each member at each goal."""
        scores = self.shown.scores
        return tuple(
            tuple(
                GoalResult(
                    reason=Reason(scores.reason[h, g]),
                    pair=scores.pair_names[scores.pair[h, g]] if scores.pair[h, g] >= 0 else None,
                    measure=float(scores.dexterity[h, g]),
                )
                for g in range(self.goals)
            )
            for h in self.shown.rows
        )

    @property
    def is_sound(self) -> bool:
        """Whether no checked answer is false, of the file and of the postures shown."""
        return (
            self.verification.is_sound
            and all(map(self.is_confirmed, self.findings))
            and (self.tours is None or self.tours.plan.false == 0)
        )

    def is_confirmed(self, goal: int) -> bool:
        """Return whether Drake confirms the posture shown at a goal, and its measure."""
        finding = self.findings[goal]
        return finding.is_true and finding.dexterity_error <= DEXTERITY_BAR

    @cached_property
    def assignment(self) -> tuple[int | None, ...]:
        """Number of the member that serves each goal, from 0; None where no member reaches it."""
        return assign_goals(self.shown.scores, self.shown.rows)

    @cached_property
    def distributions(self) -> tuple[Distribution, ...]:
        """Distribution of the reasons over the grid, for each goal."""
        return tuple(Distribution.of(self.scored.scores, goal) for goal in range(self.goals))

    @property
    def unreached(self) -> tuple[int, ...]:
        """The goals that no member reaches."""
        return tuple(goal for goal, number in enumerate(self.assignment) if number is None)

    def to_json(self) -> dict[str, Any]:
        """Return the set, its scores and the results of the checks as plain containers."""
        reachability, manipulability = self.scores
        return {
            "members": [member.to_json() for member in self.shown.members],
            # Seven sevenths add up to 1 only after rounding.
            "reachability": round(reachability, 12),
            "manipulability": round(manipulability, 12),
            "measure": self.measure,
            "unreached_goals": list(self.unreached),
            "verification": self.verification.to_json(),
            "shown_checked": len(self.findings),
            "shown_false": [goal for goal in self.findings if not self.is_confirmed(goal)],
            "tours": None if self.tours is None else self.tours.to_json(),
            "is_sound": self.is_sound,
            "seconds": self.seconds,
        }

    def explanation(self, goal: int) -> Explanation:
        """Return what would have to change for the set to reach a goal."""
        from_where = self.shown.members[0] if self.shown.members else None
        observed = self.file.observed_states[self.shown.table]
        return explain(self.file, goal, from_where, observed=observed or None)


def make_score_report(
    path: Path,
    *,
    here: InitialConfiguration | None = None,
    max_members: int | None = None,
    observed: Mapping[str, float] | None = None,
    refined: bool = True,
    sizes: CheckSizes | None = None,
    tours: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> ScoreReport:
    """Return the report of a score file: verified with Drake and drawn.

    Args:
        path: A score file.
        here: The current state; None if it is not known.
        max_members: Most members of the set; by default as many as the file holds.
        observed: Observed values of the observed axes [m or rad].
        refined: Whether a refined set may be reported.
        sizes: How many pairs to verify.
        tours: Whether to plan the motions of the set, and re-check them.
        on_progress: Called with the numbers of pairs done and in total.

    Raises:
        StoreError: If the file cannot be used, or was made from other models.
        SelectionError: If there is no such set.
        RobotError: If motions are planned and a velocity limit is unknown.
    """
    begun, sizes = time.perf_counter(), sizes or CheckSizes()
    file = load_scores(path)
    shown = ShownSet.of(file, here, max_members, observed, refined=refined)
    scored = scored_scenes(file, shown)
    served = {
        goal: shown.rows[number]
        for goal, number in enumerate(assign_goals(shown.scores, shown.rows))
        if number is not None
    }
    pairs = [(h, goal) for goal, h in served.items()]
    if shown.refined is None:
        findings = check_pairs(file, shown.table, pairs)
    else:
        order = shown.refined.order
        of_members = [(order[i], goal) for i, goal in pairs]
        findings = check_refined(file, shown.table, shown.refined.row, of_members)
    return ScoreReport(
        path=path,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
        file=file,
        job=scored[0].job,
        shown=shown,
        max_members=max_members,
        verification=verify(
            file, pairs=sizes.pairs, dense=sizes.dense, seed=sizes.seed, on_progress=on_progress
        ),
        findings=dict(zip(served, findings, strict=True)),
        sizes=sizes,
        tours=_tours(file, shown, scored) if tours else None,
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


def _tours(file: ScoreFile, shown: ShownSet, scored: Sequence[ScoredScene]) -> Tours:
    """Plan the motions of a set, and measure their clearances."""
    first = shown.table * scored[0].job.grid.size
    planned = plan(file, shown.refined or [first + index for index in shown.indices])
    before = [scene.positions() for _, scene in scored]
    names = file.hand_names or ("",)
    tours = Tours.of(planned, {name: scene for name, (_, scene) in zip(names, scored, strict=True)})
    for (_, scene), positions in zip(scored, before, strict=True):
        scene.restore(positions)
    return tours
