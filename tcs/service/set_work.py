"""The work of jobs that start from the best sets of a score file: people, refinement, motions."""

from __future__ import annotations

from typing import Any

from tcs.service.conversions import table_of
from tcs.service.jobs import Progress
from tcs.service.limits import Limits
from tcs.service.requests import MotionsRequest, PopulationRequest, RefineRequest
from tcs.service.score_files import ScoreFiles

# Drake and the compiler are loaded by the process that does the work.


class SetWork:
    """Does the work of jobs, one at a time."""

    def __init__(self, files: ScoreFiles, limits: Limits) -> None:
        """Work with the files of a service."""
        self._files, self._limits = files, limits

    def population(self, request: PopulationRequest, progress: Progress) -> dict[str, Any]:
        """Return whom the best sets serve, as `tcs population --json`.

        Raises:
            TcsError: As `tcs.population`.
        """
        from tcs.model.people import draw_bodies
        from tcs.placement.population import population
        from tcs.placement.selection import Top

        file = self._files.for_scene(request.file)
        found = population(
            file,
            draw_bodies(request.bodies, sex=request.sex, seed=request.seed),
            top=Top(count=request.sets, min_apart=request.min_apart),
            errors=request.errors,
            seed=request.seed,
            table=table_of(file, request),
            jobs=self._limits.threads,
            on_progress=progress,
            on_compile=progress.compiling,
        )
        return found.to_json()

    def refine(self, request: RefineRequest, progress: Progress) -> dict[str, Any]:
        """Return what a refinement gained, as `tcs refine --json`, with the digest as `file`.

        Raises:
            TcsError: As `tcs.refine`.
        """
        from tcs.motion import refine
        from tcs.placement.refinement import refinement_summary

        file = self._files.for_scene(request.file)
        table = table_of(file, request)
        done = refine(
            file,
            objective=request.objective,
            starts=request.starts,
            rounds=request.rounds,
            samples=request.samples,
            keep_success=request.keep_success,
            body_collisions=request.body_collisions,
            seed=request.seed,
            table=table,
            jobs=self._limits.threads,
            on_progress=progress,
            on_compile=progress.compiling,
        )
        return {**refinement_summary(done, table), "file": self._files.add_made(done).entry.file}

    def motions(self, request: MotionsRequest, progress: Progress) -> dict[str, Any]:
        """Return which goals can be done, as `tcs motions --json`, and hold it for selection.

        Raises:
            TcsError: As `tcs.examine`.
        """
        from tcs.motion.examine import examination, examine

        file = self._files.for_scene(request.file)
        table = table_of(file, request)
        found = examine(
            file,
            within=None if request.pairs else request.within,
            most=request.most,
            sample=request.sample,
            table=table,
            seed=request.seed,
            jobs=self._limits.threads,
            on_progress=progress,
            on_compile=progress.compiling,
        )
        self._files.hold_motions(request.file, found)
        return {**examination(file, found, table), "file": request.file}
