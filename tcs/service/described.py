"""Scenes that clients describe, built and scored in a process of their own.

Drake keeps every other thread of its process waiting while it builds a scene, and what a client
describes may take any time. What ships is built in the process of the service.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tcs.errors import BusyError, TcsError
from tcs.files.json_values import without_infinities
from tcs.files.writing import make_private_folder
from tcs.output.words import goal_index
from tcs.placement.store import MotionFile
from tcs.service.conversions import state_of
from tcs.service.heavy_imports import import_heavy
from tcs.service.jobs import Progress
from tcs.service.limits import Limits
from tcs.service.postures import ScenePostures
from tcs.service.requests import PostureRequest
from tcs.service.responses import FileEntry
from tcs.service.score_files import HeldFile, ScoreFiles
from tcs.service.sent_documents import SentDocuments
from tcs.service.set_work import SetWork
from tcs.service.work import SceneWork
from tcs.service.worker import Worker, WorkerPool, report

_COMPILING = "compiling"
"""What is reported in place of amounts of work while the kernel is compiled."""


@dataclass(frozen=True, slots=True)
class _Done:
    """What came of the work: its result, the files that were made, and the motions found."""

    result: dict[str, Any]
    made: tuple[tuple[Path, FileEntry], ...]
    motions: MotionFile | None


class DescribedScenes:
    """Work with scenes that clients described, one at a time."""

    def __init__(self, files: ScoreFiles, folder: Path, limits: Limits) -> None:
        """Start nothing yet.

        Args:
            files: The files of the service.
            folder: Folder of the service, where the process has one of its own.
            limits: Limits of time and memory.
        """
        self._files, self._limits = files, limits
        self._folder = folder / "described"
        self._sent = SentDocuments(self._folder)
        self._worker = Worker(memory=limits.scene_bytes, imports=("tcs.placement.scoring",))
        self._lock = threading.Lock()

    def close(self) -> None:
        """End the process."""
        self._worker.close()

    def do(self, what: str, request: Any, progress: Progress | None = None) -> dict[str, Any]:
        """Return the result of some work.

        Args:
            what: Name of the work, as in `work_by_name`.
            request: The request.
            progress: Reports the progress of a job.

        Raises:
            ServiceError: If it meets a limit.
            TcsError: As the work.
        """

        def on_report(amounts: Any) -> None:
            if progress is None:
                return
            if amounts == _COMPILING:
                progress.compiling()
            else:
                progress(*amounts)

        file = getattr(request, "file", None)
        held = None if file is None else self._files.held(file)
        seconds = self._limits.parse_seconds if progress is None else self._limits.job_seconds
        if not self._lock.acquire(timeout=seconds):
            raise BusyError("another scene that was sent is being scored. Try again later.")
        try:
            make_private_folder(self._folder)
            with self._sent.kept_if_used(request):
                done: _Done = self._worker.call(
                    _done, what, request, held, self._folder, self._limits,
                    seconds=seconds, what="the scene that was sent", on_report=on_report,
                    look=(lambda: None) if progress is None else progress.check,
                )  # fmt: skip
        finally:
            self._lock.release()
        for path, entry in done.made:
            self._files.adopt(path, entry, is_described=True)
        if done.motions is not None and file is not None:
            self._files.hold_motions(file, done.motions)
        return done.result


# ---- In the process -----------------------------------------------------------------------------


class _Reporting:
    """Progress of a job, for the process of the service."""

    def __call__(self, done: int, total: int) -> None:
        report((done, total))

    def compiling(self) -> None:
        report(_COMPILING)


@dataclass(frozen=True, slots=True)
class _Kept:
    """What is kept from one call to the next: scenes and files."""

    files: ScoreFiles
    sent: SentDocuments
    work: Mapping[str, Callable[[Any, Any], dict[str, Any]]]


_kept: _Kept | None = None


def work_by_name(work: SceneWork, sets: SetWork) -> dict[str, Callable[[Any, Any], dict[str, Any]]]:
    """Return the work of jobs by its name."""
    return {
        "score": work.score,
        "score-here": work.score_here,
        "evaluate": work.evaluate,
        "plan": work.plan,
        "scene": work.scene,
        "population": sets.population,
        "refine": sets.refine,
        "motions": sets.motions,
        "rescore": work.rescore,
    }


def _begin(folder: Path, limits: Limits) -> _Kept:
    parsing = WorkerPool(0, memory=0)
    files, sent = ScoreFiles(folder, limits, parsing), SentDocuments(folder)
    postures = ScenePostures()

    def posture(request: PostureRequest, _progress: Any) -> dict[str, Any]:
        stated = state_of(request.here, request.torso, request.at)
        file = files.for_scene(request.file)
        goal = None if request.goal is None else goal_index(file, request.goal)
        return postures.at(request.file, file, stated, goal=goal, arm=request.arm)

    work = work_by_name(SceneWork(files, sent, limits), SetWork(files, limits))
    return _Kept(files, sent, {**work, "posture": posture})


def _done(what: str, request: Any, held: HeldFile | None, folder: Path, limits: Limits) -> _Done:
    """Do some work in this process."""
    global _kept
    if _kept is None:
        import_heavy()
        _kept = _begin(folder, limits)
    files = _kept.files
    if held is not None:
        files.lend(held)
    before = {entry.file for entry in files.entries()}
    try:
        result = dict(without_infinities(_kept.work[what](request, _Reporting())))
    except TcsError as error:
        raise _kept.sent.without_folder(error) from None
    made = tuple(
        (files.held(one.file).path, one) for one in files.entries() if one.file not in before
    )
    motions = files.known_motions(held.entry.file) if held is not None else None
    return _Done(result, made, motions)
