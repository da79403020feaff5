"""Scoring in an environment that has been changed on the floor: what is moved, added or set."""

from __future__ import annotations

import dataclasses
import math
import time

from tcs.errors import SelectionError
from tcs.model.grid import Axis, Grid
from tcs.model.scene.changes import EnvironmentChanges, Shift, changed_environment
from tcs.model.scene.pieces import PlacedPiece
from tcs.placement.constraints import Constraints, recorded_constraints
from tcs.placement.scoring.offline import ScoringSetup
from tcs.placement.scoring.rebuild import recorded_job
from tcs.placement.store import ScoreFile
from tcs.service.conversions import regions_of, settings_of
from tcs.service.jobs import Progress
from tcs.service.requests import RescoreRequest
from tcs.service.sent_documents import SentDocuments


def rescored(
    file: ScoreFile,
    request: RescoreRequest,
    sent: SentDocuments,
    threads: int,
    progress: Progress,
) -> ScoreFile:
    """Return the scores of a file's task in a changed environment.

    Args:
        file: The score file, of the environment before the changes.
        request: The changes.
        sent: Keeps the file of the changed environment, by which the scores name it.
        threads: Number of threads.
        progress: Reports the configurations done and in all.

    Raises:
        SelectionError: If the file is of several arms.
        UnknownNameError: If nothing has the name of something that is moved.
        TcsError: As `tcs.score`.
    """
    if file.arms:
        raise SelectionError(
            f"a changed environment is scored for one arm, but the file is of "
            f"{' and '.join(file.arms)}. Score the task with the robot of one arm."
        )
    begun = time.perf_counter()
    grid = file.configurations
    changed = changed_environment(
        recorded_job(file.metadata).spec.environment,
        changes_of(request),
        {axis.name: axis for axis in grid_of_state(grid, request).axes},
    )
    recorded = recorded_constraints(file.metadata)
    forbid = (*recorded.forbid, *regions_of(request.forbid))
    setup = ScoringSetup.load(
        file.metadata["task"], sent.made(changed), file.metadata["robot"],
        measure=file.metadata["measure"], jobs=threads,
        sets={"max_members": request.max_members}, constraints=Constraints(forbid=forbid),
        approach="approach" in file.metadata,
    )  # fmt: skip
    return setup.score(begun=begun, on_progress=progress, on_compile=progress.compiling)


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
