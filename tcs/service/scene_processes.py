"""Processes in which scenes are built, scored and posed.

Drake keeps every other thread of its process waiting while it builds a scene, and so does what
Python does between calls of the kernel. None of it is done where requests are answered.
"""

from __future__ import annotations

import json
import threading
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from tcs.errors import BusyError, EnvironmentFileError, TcsError
from tcs.files.documents import checked
from tcs.files.plain import without_infinities
from tcs.files.writing import make_private_folder
from tcs.output.words import goal_index
from tcs.placement.store import MotionFile, ScoreFile
from tcs.service.conversions import state_of
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
_DRAWING = ("tcs.output.report.score.pictures", "tcs.output.view.scene_objects")
"""What scenes are drawn with; scoring does without."""


@dataclass(frozen=True, slots=True)
class OfFile:
    """A request for something that is made from a score file alone."""

    file: str
    """Its digest."""


@dataclass(frozen=True, slots=True)
class _Done:
    """What came of the work: its result in JSON, the files that were made, the motions found.

    The process of the service only passes the text on: reading or writing it would keep its other
    threads waiting.
    """

    result: str
    made: tuple[tuple[Path, FileEntry], ...]
    motions: MotionFile | None


class SceneProcess:
    """A process that does work with scenes, one at a time; the first work starts it."""

    def __init__(
        self,
        files: ScoreFiles,
        folder: Path,
        limits: Limits,
        *,
        memory: int | None,
        is_described: bool = False,
    ) -> None:
        """Start nothing yet.

        Args:
            files: The files of the service.
            folder: Folder for the files of the process; it need not exist.
            limits: Limits of time, and the number of threads.
            memory: Most bytes that the work takes; None for no limit.
            is_described: Whether clients describe the scenes, rather than name those that ship.
        """
        self._files, self._folder, self._limits = files, folder, limits
        self._is_described = is_described
        self._sent = SentDocuments(folder, limits.document_bytes)
        self._worker = Worker(memory=memory, imports=("tcs.placement.scoring",))
        self._lock = threading.Lock()

    def close(self) -> None:
        """End the process."""
        self._worker.close()

    def prepare(self, names: Mapping[str, str] | None = None) -> None:
        """Start the process and import what it needs.

        Args:
            names: Task, environment and robot of the likely first request of a live scorer, which
                is built; None for none.

        Raises:
            TcsError: As `tcs.LiveScorer`, and if there is no machine code yet.
        """
        make_private_folder(self._folder)
        self._worker.call(
            _prepared, names, self._folder, self._limits,
            seconds=self._limits.job_seconds, what="the preparation",
        )  # fmt: skip

    def do(self, what: str, request: Any, progress: Progress | None = None) -> str:
        """Return the result of some work, in JSON.

        Args:
            what: Name of the work, as in `work_by_name`, "posture" or "environment".
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
            raise BusyError("another scene is being built or scored. Try again later.")
        try:
            make_private_folder(self._folder)
            with self._sent.kept_if_used(request):
                done: _Done = self._worker.call(
                    _done, what, request, held, self._folder, self._limits,
                    seconds=seconds, what="the work with the scene", on_report=on_report,
                    look=(lambda: None) if progress is None else progress.check,
                )  # fmt: skip
        finally:
            self._lock.release()
        for path, entry in done.made:
            self._files.adopt(path, entry, is_described=self._is_described)
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
    scenes: SceneWork
    work: Mapping[str, Callable[[Any, Any], dict[str, Any]]]


_kept: dict[Path, _Kept] = {}
"""By the folder: one, but for tests, which make the calls of several in their own process."""


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


def _kept_of(folder: Path, limits: Limits) -> _Kept:
    """Return what is kept, made by the first call."""
    if folder not in _kept:
        # Of a job that is cancelled, joblib reports the parts whose results are not used.
        warnings.filterwarnings("ignore", category=UserWarning, module="joblib")
        files, sent = ScoreFiles(folder, limits, WorkerPool(0, memory=0)), SentDocuments(folder)
        postures, scenes = ScenePostures(), SceneWork(files, sent, limits)

        def posture(request: PostureRequest, _progress: Any) -> dict[str, Any]:
            stated = state_of(request.here, request.torso, request.at)
            file = files.for_scene(request.file)
            goal = None if request.goal is None else goal_index(file, request.goal)
            return postures.at(request.file, file, stated, goal=goal, arm=request.arm)

        def environment(request: OfFile, _progress: Any) -> dict[str, Any]:
            return {"text": _environment_of(files.loaded(request.file))}

        work = work_by_name(scenes, SetWork(files, limits))
        _kept[folder] = _Kept(
            files, sent, scenes, {**work, "posture": posture, "environment": environment}
        )
    return _kept[folder]


def _environment_of(file: ScoreFile) -> str:
    """Return the environment of a score file, as the text of a file for `--environment`."""
    from tcs.model.scene import EnvironmentFile
    from tcs.model.scene.changes import environment_text

    where = "environment of the score file"
    environment = checked(file.environment, EnvironmentFile, where, EnvironmentFileError)
    return environment_text(environment, portable=True)


def _prepared(names: Mapping[str, str] | None, folder: Path, limits: Limits) -> None:
    """Import what the work needs in this process, and build a live scorer."""
    kept = _kept_of(folder, limits)
    if names is not None:
        kept.scenes.prepare(names)
    for name in _DRAWING:
        import_module(name)


def _done(what: str, request: Any, held: HeldFile | None, folder: Path, limits: Limits) -> _Done:
    """Do some work in this process."""
    kept = _kept_of(folder, limits)
    files = kept.files
    if held is not None:
        files.lend(held)
    before = {entry.file for entry in files.entries()}
    try:
        result = without_infinities(kept.work[what](request, _Reporting()))
    except TcsError as error:
        raise kept.sent.without_folder(error) from None
    made = tuple(
        (files.held(one.file).path, one) for one in files.entries() if one.file not in before
    )
    motions = files.known_motions(held.entry.file) if held is not None else None
    return _Done(json.dumps(result, allow_nan=False), made, motions)
