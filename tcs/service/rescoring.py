"""Scoring in an environment that has been changed on the floor: what is moved, added or set."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Mapping
from typing import Any

from tcs.errors import SelectionError
from tcs.model.grid import Axis, Grid, thinned
from tcs.model.scene import Scene, SceneSpec
from tcs.model.scene.changes import EnvironmentChanges, Shift, changed_environment
from tcs.model.scene.pieces import PlacedPiece
from tcs.placement.constraints import Constraints, recorded_constraints
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.offline import load_setups, score_setups
from tcs.placement.scoring.rebuild import recorded_jobs
from tcs.placement.store import APPROACH, ARMS, PAPER, ScoreFile
from tcs.service.conversions import regions_of, settings_of
from tcs.service.jobs import Progress
from tcs.service.requests import RescoreRequest
from tcs.service.sent_documents import SentDocuments


class Rescorer:
    """Scores in changed environments; used by one thread.

    Building a scene takes as long as scoring a state of it, so the last one is kept: the visible
    state, a coarse grid first, and then all states are scored in the same scene.
    """

    def __init__(self, sent: SentDocuments, threads: int) -> None:
        """Keep nothing yet.

        Args:
            sent: Keeps the files of changed environments, by which the scores name them.
            threads: Number of threads.
        """
        self._sent, self._threads = sent, threads
        self._job: tuple[Mapping[str, Any], Job] | None = None
        self._scenes: list[tuple[tuple[tuple[str, str], ...], Scene]] = []
        """Scenes of the last environment, with the contacts that each allows."""

    def rescored(self, file: ScoreFile, request: RescoreRequest, progress: Progress) -> ScoreFile:
        """Return the scores of a file's task in a changed environment.

        Args:
            file: The score file, of the environment before the changes.
            request: The changes.
            progress: Reports the configurations done and in all.

        Raises:
            UnknownNameError: If nothing has the name of something that is moved.
            TcsError: As `tcs.score`.
        """
        begun = time.perf_counter()
        grid = grid_of_state(file.configurations, request)
        grid = thinned(grid, request.every, request.around)
        changed = changed_environment(
            self._job_of(file).spec.environment,
            changes_of(request),
            {axis.name: axis for axis in grid.axes},
        )
        recorded = recorded_constraints(file.metadata)
        forbid = (*recorded.forbid, *regions_of(request.forbid))
        setups = load_setups(
            file.metadata["task"], self._sent.made(changed), file.metadata["robot"],
            measure=file.metadata["measure"], jobs=self._threads,
            sets={"max_members": request.max_members}, constraints=Constraints(forbid=forbid),
            approach=APPROACH in file.metadata, build=self._scene_of,
            arms=file.metadata.get(ARMS), paper=PAPER in file.metadata,
        )  # fmt: skip
        return score_setups(
            setups, begun=begun, on_progress=progress, on_compile=progress.compiling
        )

    def _job_of(self, file: ScoreFile) -> Job:
        """Return the job of a file's first hand, the same as the last time for the same file."""
        if self._job is None or self._job[0] is not file.metadata:
            self._job = (file.metadata, recorded_jobs(file.metadata)[0])
        return self._job[1]

    def _scene_of(self, job: Job) -> Scene:
        """Return the scene of a job: one of the last where only the grid is another."""
        contacts = tuple(job.task.allowed_contacts)
        for allowed, kept in self._scenes:
            if allowed == contacts and _is_same_scene(kept.spec, job.spec):
                return kept
        # Those of other environments are of no use any more.
        self._scenes = [
            (allowed, kept)
            for allowed, kept in self._scenes
            if _is_same_environment(kept.spec, job.spec)
        ]
        self._scenes.append((contacts, job.scene()))
        return self._scenes[-1][1]


def _is_same_scene(first: SceneSpec, second: SceneSpec) -> bool:
    """Return whether two scenes differ in nothing but the grid that is scored in them."""
    return first.robot == second.robot and _is_same_environment(first, second)


def _is_same_environment(first: SceneSpec, second: SceneSpec) -> bool:
    """Return whether two environments differ in nothing but the grid that is scored in them."""
    first_environment, second_environment = (
        spec.environment.model_copy(update={"grid": {}}) for spec in (first, second)
    )
    return first_environment == second_environment


def changes_of(request: RescoreRequest) -> EnvironmentChanges:
    """Return the changes of a request in m and rad."""
    return EnvironmentChanges(
        shifts={
            name: Shift(x=move.x, y=move.y, yaw=math.radians(move.turn_deg))
            for name, move in request.move.items()
        },
        pieces=tuple(
            PlacedPiece(piece=one.piece, x=one.x, y=one.y, yaw=math.radians(one.turn_deg))
            for one in request.add
        ),
        joints=settings_of(request.joints, "joints"),
    )


def grid_of_state(grid: Grid, request: RescoreRequest) -> Grid:
    """Return the grid of a request: with the one state of the environment, or with all.

    Raises:
        SelectionError: If the one state lacks an axis, or names another.
    """
    if not request.only_state:
        return grid
    known = {f"{a.name}_deg" if a.unit == "deg" else a.name: a for a in grid.environment_axes}
    if set(request.at) != set(known):
        raise SelectionError(
            f"'at' must set {', '.join(known) or 'nothing'} where 'only_state' is true."
        )
    states = {
        axis.name: Axis(axis.name, axis.unit, float(request.at[key]), 0.0, 1)
        for key, axis in known.items()
    }
    axes = tuple(states.get(axis.name, axis) for axis in grid.axes)
    return dataclasses.replace(grid, axes=axes)
