"""Sets that can be executed: goals count only where a motion to them was found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.constraints import Constraints
from tcs.placement.selection.admission import Admitted
from tcs.placement.selection.choice import Choice
from tcs.placement.selection.observed import Match
from tcs.placement.store import MotionFile, ScoreFile
from tcs.placement.tables import MotionTable, SetTable, tc_reachability


def motions_at(file: ScoreFile, motions: MotionFile, match: Match) -> MotionTable:
    """Return the motions that were planned for the table of an observation.

    Args:
        file: The score file.
        motions: Its motions.
        match: The table that selection uses.

    Raises:
        StoreMismatchError: If the motions were planned for other scores.
        SelectionError: If none were planned for this table, or limbs are observed one by one.
    """
    motions.check_belongs(file)
    table = motions.tables[match.index]
    if table is None:
        raise SelectionError(
            "No motions were planned for the observed state. Plan them: tcs motions FILE with "
            "--observed."
        )
    if any(one.index != match.index for one in match.by_frame):
        raise SelectionError(
            "Limbs are observed in different places, but motions were planned for one table. Give "
            "one frame, or plan for the set that is selected: tcs plan."
        )
    return table


def admitted_executable(
    table: MotionTable, sets: SetTable, constraints: Constraints, admitted: Admitted | None
) -> Admitted:
    """Return the examined candidates from which some goal can be done, with those goals alone.

    Args:
        table: The motions.
        sets: The candidates.
        constraints: The constraints of the selection.
        admitted: The candidates that satisfy them; None for all.

    Raises:
        SelectionError: If an obstacle is given too, or no candidate is left.
    """
    if constraints.blocked:
        raise SelectionError(
            "Motions were planned without the further obstacles. Score the scene with them "
            "(tcs score ... --blocked) and plan its motions (tcs motions)."
        )
    done = done_by_candidate(table, sets)
    everything = np.ones(len(sets.candidates), dtype=np.bool_)
    found = admitted or Admitted(everything, sets.reached, sets.dexterity, (), (), None)
    reached = found.reached & done
    remaining = found.candidates & reached.any(axis=1)
    if not np.any(remaining):
        raise SelectionError(
            "From no examined configuration that the constraints leave can a goal be done. Examine "
            "more: tcs motions FILE with a greater --within, or --pairs."
        )
    dexterity = np.where(reached, found.dexterity, np.float32(0.0))
    return replace(
        found, candidates=remaining, reached=reached, dexterity=dexterity, has_lower_scores=True
    )


def done_by_candidate(table: MotionTable, sets: SetTable) -> NDArray[np.bool_]:
    """Return whether each goal can be done from each candidate, False if not examined, (C, G)."""
    done = np.zeros(sets.reached.shape, dtype=np.bool_)
    known = np.isin(sets.candidates, table.configurations)
    rows = np.searchsorted(table.configurations, sets.candidates[known])
    done[known] = table.done[rows]
    return done


@dataclass(frozen=True, kw_only=True)
class Executability:
    """What it costs to choose among sets that can be executed."""

    examined: int
    """Number of candidates for which motions were planned."""
    candidates: int
    """Number of all candidates."""
    goals_done: tuple[int, ...]
    """Goals that the chosen set can do."""
    by_postures: Choice
    """The set that would be chosen if every goal that a posture reaches could be done."""
    is_examined: bool
    """Whether motions were planned for all members of that set."""
    reachability_done: float
    """P_R of that set over the goals for which a motion was found."""

    @classmethod
    def of(
        cls, file: ScoreFile, motions: MotionFile, chosen: Choice, by_postures: Choice
    ) -> Executability:
        """Compare a set that `select` chose from a file with motions with the one without.

        Raises:
            SelectionError: If no motions were planned for the table of the sets.
        """
        if chosen.match is None:
            raise SelectionError("The set was not selected from a score file.")
        table = motions_at(file, motions, chosen.match)
        sets = file.tables[chosen.match.index].sets
        done = done_by_candidate(table, sets)

        def goals(choice: Choice) -> NDArray[np.bool_]:
            rows = np.searchsorted(sets.candidates, choice.indices)
            return np.asarray(np.any(done[rows], axis=0))

        return cls(
            examined=int(np.count_nonzero(np.isin(sets.candidates, table.configurations))),
            candidates=len(sets.candidates),
            goals_done=tuple(np.flatnonzero(goals(chosen)).tolist()),
            by_postures=by_postures,
            is_examined=bool(np.all(np.isin(by_postures.indices, table.configurations))),
            reachability_done=float(tc_reachability(goals(by_postures), sets.weights)),
        )

    def to_json(self, chosen: Choice) -> dict[str, Any]:
        """Return the comparison as plain containers.

        Args:
            chosen: The chosen set; `costs` is what the other one has more.
        """
        names = ("reachability", "manipulability", "utility")
        other = self.by_postures
        return {
            "examined": self.examined,
            "candidates": self.candidates,
            "goals_done": list(self.goals_done),
            "by_postures": {
                "members": [other.members[i].to_json() for i in other.order],
                **{name: round(getattr(other, name), 12) for name in names},
                "examined": self.is_examined,
                "reachability_done": round(self.reachability_done, 12)
                if self.is_examined
                else None,
            },
            "costs": {
                name: round(getattr(other, name) - getattr(chosen, name), 12) for name in names
            },
        }
