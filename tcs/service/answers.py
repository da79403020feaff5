"""Answers to requests about score files, from the files alone."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

from tcs.errors import ServiceError
from tcs.files.plain import without_infinities
from tcs.output.words import choice_in_words, explanation_in_words, goal_index
from tcs.placement.constraints import scored_entries
from tcs.placement.reasons import explain, fix_weights
from tcs.placement.selection import Executability, Top, select
from tcs.placement.store import MotionFile
from tcs.service.conversions import (
    constraints_of,
    observed_of,
    state_of,
    table_of,
    travel_of,
    utility_of,
)
from tcs.service.floor import floor_of, outcome_of
from tcs.service.limits import Limits
from tcs.service.requests import ExplainRequest, FloorRequest, OutcomeRequest, SelectRequest
from tcs.service.score_files import HeldFile, ScoreFiles
from tcs.service.worker import WorkerPool


class Answers:
    """Answers requests; those about one file one after the other."""

    def __init__(self, files: ScoreFiles) -> None:
        """Answer from files."""
        self._files = files

    def select(self, request: SelectRequest) -> dict[str, Any]:
        """Return the set with the greatest utility, as `tcs select --json`.

        Raises:
            NotFoundError: If the score file is not held.
            ServiceError: If torso or settings are given without the base pose.
            TcsError: As `tcs.select`.
        """
        with self._files.held(request.file).lock:
            file = self._files.loaded(request.file)
            motions = self._files.motions(request.file) if request.executable else None
            if request.here is None and (request.torso or request.at):
                raise ServiceError("'torso' and 'at' require 'here'.")
            here = None
            if request.here is not None:
                here = state_of(request.here, request.torso, request.at)
            choose = partial(
                select,
                file,
                here,
                weights=utility_of(request),
                travel=travel_of(request),
                constraints=constraints_of(request, request.prefer),
                top=None
                if request.top is None
                else Top(count=request.top, min_apart=request.min_apart),
                max_members=request.max_members,
                observed=observed_of(request.observed, file.observed_axes),
                frames=request.frames,
                parking=request.parking,
            )
            choice = choose(motions=motions)
            result = {**choice_in_words(file, choice, here), **scored_entries(file)}
            if motions is not None:
                compared = Executability.of(file, motions, choice, choose())
                result["executable"] = compared.to_json(choice)
        return dict(without_infinities(result))

    def explain(self, request: ExplainRequest) -> dict[str, Any]:
        """Return why a goal is not reached and the cheapest change, as `tcs explain --json`.

        Raises:
            NotFoundError: If the score file is not held.
            ServiceError: If both a configuration and a state are given.
            TcsError: As `tcs.explain`.
        """
        if request.configuration is not None and request.here is not None:
            raise ServiceError("give 'configuration' or 'here', not both.")
        if request.here is None and (request.at or request.torso):
            raise ServiceError("'torso' and 'at' require 'here'.")
        with self._files.held(request.file).lock:
            file = self._files.loaded(request.file)
            explanation = explain(
                file,
                goal_index(file, request.goal),
                request.configuration
                if request.here is None
                else state_of(request.here, request.torso, request.at),
                weights=fix_weights(
                    file.configurations,
                    metre=request.metre_weight,
                    turn=request.turn_weight,
                    torso=request.torso_weight,
                    environment=tuple(request.axis_weight.items()),
                    route=request.travel,
                ),
                observed=observed_of(request.observed, file.observed_axes),
                frames=request.frames,
            )
            if request.arm is not None:
                # Imported here: other explanations need neither simulator nor compiler.
                from tcs.placement.refinement.by_arm import explained_by_arm

                explanation = explained_by_arm(explanation, request.arm)
            result = explanation_in_words(file, explanation)
        return dict(without_infinities(result))

    def floor(self, request: FloorRequest) -> dict[str, Any]:
        """Return the best scores at each base position, as `tcs.service.floor.floor_of`.

        Raises:
            NotFoundError: If the score file is not held.
            GridError: If there is no such state of the environment.
        """
        with self._files.held(request.file).lock:
            file = self._files.loaded(request.file)
            motions = self._files.known_motions(request.file)
            return floor_of(file, table_of(file, request), request.state, motions)

    def outcome(self, request: OutcomeRequest) -> dict[str, Any]:
        """Return what is reached from a base pose, as `tcs.service.floor.outcome_of`.

        Raises:
            NotFoundError: If the score file is not held.
            SelectionError: If the base pose is beyond the grid, or an axis is missing.
        """
        with self._files.held(request.file).lock:
            file = self._files.loaded(request.file)
            stated = state_of(request.here, request.torso, request.at)
            return outcome_of(file, table_of(file, request), stated, best=request.best)


_LOADED = 2
"""Most score files in the memory of a process that answers large requests."""
_files: ScoreFiles | None = None


def answer_in_process(name: str, request: Any, held: HeldFile, motions: MotionFile | None) -> str:
    """Return the answer to a request about a file of another process, in this one, in JSON.

    Args:
        name: Name of the method of `Answers`.
        request: The request.
        held: The file.
        motions: Its motions, if any were found.
    """
    global _files
    if _files is None:
        _files = ScoreFiles(Path(), Limits(loaded_files=_LOADED), WorkerPool(0, memory=0))
    _files.lend(held)
    if motions is not None:
        _files.hold_motions(held.entry.file, motions)
    return json.dumps(getattr(Answers(_files), name)(request), allow_nan=False)
