"""The engine: answers requests about score files, and does longer work as jobs."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Self

from tcs.errors import ServiceError
from tcs.files.documents import Document
from tcs.files.writing import scratch_folder
from tcs.kernel.dexterity import dexterity
from tcs.model.catalogue import catalogue, check_names
from tcs.service.answers import Answers, answer_in_process
from tcs.service.jobs import Jobs, Progress
from tcs.service.limits import Limits
from tcs.service.preparation import Preparation
from tcs.service.requests import (
    EvaluateRequest,
    ExplainRequest,
    FloorRequest,
    JobRequest,
    MotionsRequest,
    OutcomeRequest,
    PlanRequest,
    PopulationRequest,
    PostureRequest,
    RefineRequest,
    RescoreRequest,
    SceneRequest,
    ScoreHereRequest,
    ScoreRequest,
    SelectRequest,
)
from tcs.service.responses import FileEntry, JobStatus
from tcs.service.scene_processes import OfFile, SceneProcess
from tcs.service.score_files import ScoreFiles
from tcs.service.sent_documents import request_of
from tcs.service.views import Views
from tcs.service.worker import WorkerPool

_DEFAULT_LIMITS = Limits()
_PARSING = ("tcs.service.answers", "tcs.service.sent_documents", "tcs.service.requests")
"""What the processes import that read what clients send."""
_NAMES: dict[type[Any], str] = {
    ScoreRequest: "score",
    ScoreHereRequest: "score-here",
    EvaluateRequest: "evaluate",
    PlanRequest: "plan",
    SceneRequest: "scene",
    PopulationRequest: "population",
    RefineRequest: "refine",
    MotionsRequest: "motions",
    RescoreRequest: "rescore",
}
"""Names of jobs, as in `work_by_name`, by their requests."""
_POLL = 60.0
"""Interval at which a waiting caller is woken without need [s]."""


class Engine:
    """Answers requests; a context manager that removes its temporary folder at the end.

    Its methods may be called from several threads. Requests about one score file are answered one
    after the other, and jobs run one at a time.
    """

    def __init__(self, limits: Limits = _DEFAULT_LIMITS) -> None:
        """Start the thread of the jobs, and make the temporary folder.

        Raises:
            OutputError: If the folder cannot be made.
        """
        self._limits = limits
        self._stack = ExitStack()
        folder = self._stack.enter_context(scratch_folder())
        self._parsing = WorkerPool(limits.parsing, memory=limits.parse_bytes, imports=_PARSING)
        self._stack.callback(self._parsing.close)
        self._files = ScoreFiles(folder, limits, self._parsing)
        self._answers = Answers(self._files)
        self._jobs = Jobs(limits)
        self._views = Views(self._files)
        ours, sent = folder / "scenes", folder / "described"
        # Whoever looks at a scene does not wait for the job that scores it.
        self._scenes = SceneProcess(self._files, ours, limits, memory=None)
        self._postures = SceneProcess(self._files, ours, limits, memory=limits.scene_bytes)
        self._described = SceneProcess(
            self._files, sent, limits, memory=limits.scene_bytes, is_described=True
        )
        for process in (self._scenes, self._postures, self._described):
            self._stack.callback(process.close)
        self._preparation: Preparation | None = None

    def __enter__(self) -> Self:
        """Return the engine."""
        return self

    def __exit__(self, *_: object) -> None:
        """Cancel the jobs and remove the temporary folder."""
        self.close()

    def close(self) -> None:
        """Cancel the jobs and remove the temporary folder."""
        if self._preparation is not None:
            self._preparation.stop()
        self._jobs.close()
        self._stack.close()

    def prepare(self, on_end: Callable[[], object] | None = None) -> Preparation:
        """Begin, in a thread, what the first job would wait for, and return it.

        The processes of scenes import Drake, load the kernel's machine code, build a scene, and
        import what draws; where there is no machine code yet, it is not compiled. Choosing from
        files needs none of this, and far less memory.

        Args:
            on_end: Called by the thread when it is done, or a step has failed.
        """
        if self._preparation is None:
            steps = (
                self._parsing.start,
                lambda: self._scenes.prepare(self._first_names()),
                self._postures.prepare,
            )
            self._preparation = Preparation(steps, on_end)
        return self._preparation

    def _first_names(self) -> dict[str, str]:
        """Return task, environment and robot of the likely first job."""
        for entry in self._files.entries()[:1]:
            metadata = self._files.loaded(entry.file).metadata
            return {key: metadata[key] for key in ("task", "environment", "robot")}
        return {"task": "shaving"}

    def request_of(self, model: type[Document], content: bytes) -> Any:
        """Return a checked request, read in a process of its own.

        Args:
            model: Model of its fields.
            content: A JSON object.

        Raises:
            TcsError: If it is not one, or a field is not of its form.
            ServiceError: If reading it meets a limit.
        """
        return self._parsing.call(
            request_of, model, content, seconds=self._limits.parse_seconds, what="the request"
        )

    @property
    def limits(self) -> Limits:
        """Its limits."""
        return self._limits

    def catalogue(self) -> dict[str, Any]:
        """Return the tasks, environments and robots that ship with tcs, as `tcs list --json`."""
        return catalogue()

    def files(self) -> list[FileEntry]:
        """Return the score files that are held."""
        return self._files.entries()

    def add_file(self, content: bytes | Sequence[bytes]) -> FileEntry:
        """Check a score file that was sent and hold it; nothing in it is called or imported.

        Args:
            content: The bytes of the file, or parts of them in their order.

        Raises:
            StoreError: If it is not a score file.
            ServiceError: If it is too large.
        """
        parts = [content] if isinstance(content, bytes) else content
        return self._files.add(parts).entry

    def open_file(self, path: Path) -> FileEntry:
        """Hold a score file of this machine until the engine is closed; not for requests.

        Motions that `tcs motions` saved beside it are held too.

        Raises:
            StoreError: If it or its motions cannot be read, or it is not a score file.
            StoreMismatchError: If the motions were planned for other scores.
        """
        return self._files.read(path).entry

    def content_of(self, file: str) -> bytes:
        """Return the bytes of a score file.

        Raises:
            NotFoundError: If it is not held.
        """
        return self._files.content(file)

    def environment_of(self, file: str) -> str:
        """Return the environment of a score file, as the text of a file for `--environment`.

        Raises:
            NotFoundError: If the score file is not held.
            EnvironmentFileError: If a model of it does not ship with tcs.
        """
        process = self._process_of(file, self._postures)
        text: str = json.loads(process.do("environment", OfFile(file)))["text"]
        return text

    def view_of(self, file: str) -> bytes:
        """Return a page with the scene in 3-D, as `tcs view --export`; it takes some seconds.

        Raises:
            NotFoundError: If the score file is not held.
            BusyError: If another page is being made.
            ServiceError: If it cannot be made, e.g. because the models have changed.
        """
        return self._views.page(file)

    def report_of(self, file: str) -> bytes:
        """Return the report of a score file as a page, as `tcs report`; it takes some seconds.

        Raises:
            NotFoundError: If the score file is not held.
            BusyError: If another page is being made.
            ServiceError: If it cannot be made, e.g. because the models have changed.
        """
        return self._views.page(file, "report")

    def select(self, request: SelectRequest) -> dict[str, Any]:
        """Return the recommended set, or that of greatest utility, as `tcs select --json`.

        Raises:
            NotFoundError: If the score file is not held.
            ServiceError: If torso or settings are given without the base pose.
            TcsError: As `tcs.select`.
        """
        return self._answers.select(request)

    def explain(self, request: ExplainRequest) -> dict[str, Any]:
        """Return why a goal is not reached and the cheapest change, as `tcs explain --json`.

        Raises:
            NotFoundError: If the score file is not held.
            ServiceError: If both a configuration and a state are given.
            TcsError: As `tcs.explain`.
        """
        return self._answers.explain(request)

    def floor(self, request: FloorRequest) -> dict[str, Any]:
        """Return the best scores at each base position, as `tcs.service.floor.floor_of`.

        Raises:
            NotFoundError: If the score file is not held.
            GridError: If there is no such state of the environment.
        """
        return self._answers.floor(request)

    def outcome(self, request: OutcomeRequest) -> dict[str, Any]:
        """Return what is reached from a base pose, as `tcs.service.floor.outcome_of`.

        Raises:
            NotFoundError: If the score file is not held.
            SelectionError: If the base pose is beyond the grid, or an axis is missing.
        """
        return self._answers.outcome(request)

    def answer_apart(self, name: str, request: Any) -> str:
        """Return what the method of a name does, in JSON, from a process of its own.

        Large requests take longer: those of others about the same file need not wait for them.

        Args:
            name: "select", "explain", "floor", "outcome" or "posture".
            request: The request.

        Raises:
            ServiceError: If the answer meets a limit.
            TcsError: As the method.
        """
        if name == "posture":
            return self._process_of(request.file, self._postures).do(name, request)
        held = self._files.held(request.file)
        motions = self._files.known_motions(request.file)
        answer: str = self._parsing.call(
            answer_in_process, name, request, held, motions,
            seconds=self._limits.parse_seconds, what="the request",
        )  # fmt: skip
        return answer

    def posture(self, request: PostureRequest) -> dict[str, Any]:
        """Return the scene in space at a base pose, as `tcs.service.postures.ScenePostures.at`.

        Raises:
            NotFoundError: If the score file is not held.
            StoreMismatchError: If the models are not those the file was made from.
            SelectionError: If the base pose is beyond the grid, or there is no such goal.
        """
        found: dict[str, Any] = json.loads(self.answer_apart("posture", request))
        return found

    def _process_of(self, file: str, ours: SceneProcess) -> SceneProcess:
        """Return the process for the scene of a file.

        Raises:
            NotFoundError: If the score file is not held.
        """
        return self._described if self._files.held(file).is_described else ours

    def submit(self, request: JobRequest) -> JobStatus:
        """Queue a job, and return its state.

        Raises:
            BusyError: If the queue is full.
            NotFoundError: If the score file is not held.
            UnknownNameError: If a task, environment, robot or measure of that name does not exist.
        """
        what, work = self._work_of(request)
        return self._jobs.submit(what, work)

    def job_text(self, name: str) -> str:
        """Return the state of a job and its result, in JSON; the result is not read for it.

        Raises:
            NotFoundError: If there is no such job, or it ended long ago.
        """
        return self._jobs.text(name)

    def jobs(self) -> list[JobStatus]:
        """Return the states of all jobs without their results, the oldest first."""
        return self._jobs.all()

    def job(self, name: str) -> JobStatus:
        """Return the state of a job, with its result if it is done.

        Raises:
            NotFoundError: If there is no such job, or it ended long ago.
        """
        return self._jobs.status(name)

    def next_state(self, name: str, known: JobStatus | None, seconds: float) -> JobStatus:
        """Return the state of a job as soon as it differs from a known one, or after a time [s].

        It lacks the result, which `job` returns.

        Raises:
            NotFoundError: If there is no such job.
        """
        return self._jobs.wait_for_change(name, known, seconds)

    def cancel(self, name: str) -> JobStatus:
        """Cancel a job: a waiting one at once, a running one where it next reports its progress.

        Raises:
            NotFoundError: If there is no such job.
        """
        return self._jobs.cancel(name)

    def wait(self, name: str, on_progress: Callable[[int, int], None] | None = None) -> JobStatus:
        """Wait until a job has ended, and return its state.

        Args:
            name: The job.
            on_progress: Called with the amounts of work done and in all, whenever they change.

        Raises:
            NotFoundError: If there is no such job.
        """
        status = self._jobs.wait_for_change(name, None, 0.0)
        while not status.has_ended:
            if on_progress is not None and status.total:
                on_progress(status.done, status.total)
            status = self._jobs.wait_for_change(name, status, _POLL)
        return self._jobs.status(name)

    def _work_of(self, request: JobRequest) -> tuple[str, Callable[[Progress], str]]:
        """Return what a job does and the function that does it, after quick checks."""
        what = _NAMES[type(request)]
        if isinstance(request, ScoreRequest):
            if (request.task is None) == (request.task_yaml is None):
                raise ServiceError("give 'task' or 'task_yaml', and not both.")
            check_names(request.task, request.environment, request.robot)
            dexterity(request.measure)
            is_described = request.task_yaml is not None or request.environment_yaml is not None
            process = self._described if is_described else self._scenes
        else:
            process = self._process_of(request.file, self._scenes)
        return what, partial(process.do, what, request)
