"""The scenes of a score file, in the observed state of a set."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from tcs.model.grid import InitialConfiguration
from tcs.model.scene import Scene
from tcs.output.words import (
    base_pose_text,
    basis_text,
    gain_text,
    goal_names,
    member_places,
    place_in_line,
    place_of_state,
    scores_text,
)
from tcs.placement.refinement import score_members
from tcs.placement.scoring import Job, rebuild_scenes, whole_task
from tcs.placement.selection import Choice, nearest_table, select
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedSet, ScoreTable, SuccessTable, Window


class ScoredScene(NamedTuple):
    """The job of a score file with all its goals, and its scene in the observed state of a set."""

    job: Job
    scene: Scene


def scored_scenes(
    file: ScoreFile, shown: ShownSet, *, meshes: bool = False
) -> tuple[ScoredScene, ...]:
    """Return the job and the scene of each hand of a score file.

    Args:
        file: A score file.
        shown: The set whose observed state the scenes are in.
        meshes: Whether the robot's meshes are loaded, for the viewer.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    built = rebuild_scenes(file, meshes=meshes)
    task = whole_task([job for job, *_ in built])
    found = []
    for job, scene, _ in built:
        for name, value in file.observed_states[shown.table].items():
            scene.set_joint(name, value)
        found.append(ScoredScene(dataclasses.replace(job, task=task), scene))
    return tuple(found)


class SuccessEstimate(NamedTuple):
    """Estimated success of a set under error."""

    mean: float
    """Mean over the samples."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end."""
    samples: int
    """Number of samples."""
    of_rooms: bool
    """Whether the mean is that of rooms in which all goals are done, not of P_R."""


@dataclass(frozen=True)
class ShownSet:
    """One set, its members in the order of the tour."""

    here: InitialConfiguration | None
    """The current state for which the set was selected; None if it is not known."""
    members: tuple[InitialConfiguration, ...]
    """Its configurations; empty if no configuration reaches a goal."""
    indices: tuple[int, ...]
    """Their flat configuration indices; of a refined set those from which it was refined."""
    table: int
    """Number of the state table that holds the set."""
    subtitle: str
    """How the set was selected, and its scores, as one line of text."""
    file: ScoreFile = field(repr=False, compare=False)
    """The score file."""
    choice: Choice | None = field(default=None, repr=False, compare=False)
    """What `tcs.select` returned; None for a set that was given."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        here: InitialConfiguration | None,
        max_members: int | None = None,
        observed: Mapping[str, float] | None = None,
        *,
        refined: bool = True,
    ) -> ShownSet:
        """Return the set that `tcs.select` recommends.

        Args:
            file: A score file.
            here: The current state; None if it is not known.
            max_members: Most members of the set; by default as many as the file holds.
            observed: Observed values of the observed axes [m or rad].
            refined: Whether a refined set may be shown.

        Raises:
            SelectionError: If the file holds no sets of that many members, or no set can be
                selected from the current state.
        """
        table = nearest_table(file, here, observed).index
        if here is None and not len(file.tables[table].sets.candidates):
            return cls(None, (), (), table, "no configuration reaches a goal", file)
        choice = select(file, here, max_members=max_members, observed=observed, refined=refined)
        scores = scores_text(choice.reachability, choice.manipulability, file.metadata["measure"])
        what = f"recommended, {basis_text(choice.basis)}: {scores}"
        if here is not None:
            place = place_of_state(file, table, here)
            now = f"{place_in_line(place)}, at " if place else "at "
            what = (
                f"selected for a robot {now}{base_pose_text(here.to_json())}, "
                f"travel cost {choice.cost:.2f}, {what}"
            )
        return cls(
            here,
            tuple(choice.members[i] for i in choice.order),
            tuple(choice.indices[i] for i in choice.order),
            table,
            "; ".join(part for part in (what, gain_text(choice)) if part),
            file,
            choice,
        )

    @classmethod
    def best_of(cls, file: ScoreFile, *, single: bool = False) -> ShownSet:
        """Return the set with the greatest P_R + P_M in the nominal state, as the papers rank sets.

        Args:
            file: A score file.
            single: Whether to take the best set of one configuration.
        """
        sets, grid = file.nominal.sets, file.configurations
        members = sets.best_single if single else sets.best
        table = file.nominal_index
        if not members:
            return cls(None, (), (), table, "no configuration reaches a goal", file)
        scores = scores_text(*sets.scores_of(members), file.metadata["measure"])
        places = tuple(grid.configuration(h) for h in members)
        return cls(None, places, members, table, f"best set: {scores}", file)

    @property
    def refined(self) -> RefinedSet | None:
        """The refined set that is shown; None for a set of the grid."""
        if self.choice is None or self.choice.refined is None:
            return None
        return RefinedSet(self.table, self.choice.refined, self.choice.order)

    @property
    def stored(self) -> tuple[int, ...]:
        """Flat indices of the members, ascending; () for a refined set, which is off the grid."""
        return tuple(sorted(self.indices)) if self.refined is None else ()

    @property
    def success(self) -> SuccessEstimate | None:
        """Its estimated success under error; None without an estimate."""
        table = self.file.tables[self.table]
        if self.refined is None:
            return estimate_of(table.success, self.stored)
        found = self.file.tables[self.table].refined_sets.success
        if found is None:
            return None
        row = self.refined.row
        return SuccessEstimate(*found.at(row), int(found.samples[row]), found.counts_rooms)

    @property
    def places(self) -> list[str]:
        """Where each member is relative to the person, as a sentence; "" without a person."""
        return member_places(self.file, self.table, self.indices, self.members)

    @property
    def windows(self) -> tuple[Window | None, ...]:
        """How far each member may be off, None where that is not known; () where it is of none."""
        if self.choice is None or not any(self.choice.windows):
            return ()
        return tuple(self.choice.windows[i] for i in self.choice.order)

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Where each goal is, as people say it; "" where the file does not state it."""
        return goal_names(self.file.task, self.scores.goals)

    @property
    def reachability(self) -> float:
        """P_R of the set, 0 if it has no member."""
        return self._pair[0]

    @property
    def manipulability(self) -> float:
        """P_M of the set, 0 if it has no member."""
        return self._pair[1]

    @cached_property
    def scores(self) -> ScoreTable:
        """Scores in which the members have the rows `rows`.

        Those of a refined set are computed by the kernel.
        """
        if self.refined is None:
            return self.file.tables[self.table].scores
        return score_members(self.file, self.refined).scores

    @property
    def rows(self) -> tuple[int, ...]:
        """Rows of the members in `scores`, in the order of the tour."""
        return self.indices if self.refined is None else tuple(range(len(self.members)))

    @property
    def _pair(self) -> tuple[float, float]:
        if self.choice is not None:
            return self.choice.reachability, self.choice.manipulability
        if not self.members:
            return (0.0, 0.0)
        return self.file.tables[self.table].sets.scores_of(self.stored)


def estimate_of(success: SuccessTable | None, members: tuple[int, ...]) -> SuccessEstimate | None:
    """Return the estimate of a set of the grid; None without one.

    Args:
        success: The table's estimates.
        members: Flat configuration indices, ascending.
    """
    row = success.row_of(members) if success is not None and members else None
    if success is None or row is None:
        return None
    return SuccessEstimate(*success.at(row), int(success.samples[row]), success.counts_rooms)
