"""The engine: answers requests about score files, and does longer work as jobs."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Self

from tcs.errors import EnvironmentFileError, ServiceError, TcsError, UnknownNameError
from tcs.files.documents import checked
from tcs.files.json_values import without_infinities
from tcs.files.writing import scratch_folder
from tcs.kernel.dexterity import dexterity
from tcs.model.catalogue import catalogue, check_names
from tcs.output.words import choice_in_words, explanation_in_words, goal_index
from tcs.placement.constraints import scored_entries
from tcs.placement.reasons import explain, fix_weights
from tcs.placement.selection import Executability, Top, select
from tcs.service.conversions import (
    constraints_of,
    observed_of,
    state_of,
    table_of,
    travel_of,
    utility_of,
)
from tcs.service.floor import floor_of, outcome_of
from tcs.service.heavy_imports import drawing_steps, import_heavy, import_scoring
from tcs.service.jobs import Jobs, Progress
from tcs.service.limits import Limits
from tcs.service.postures import ScenePostures
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
from tcs.service.score_files import ScoreFiles
from tcs.service.sent_documents import SentDocuments
from tcs.service.set_work import SetWork
from tcs.service.views import Views
from tcs.service.work import SceneWork

_DEFAULT_LIMITS = Limits()
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
        self._files = ScoreFiles(folder, limits)
        self._sent = SentDocuments(folder)
        self._jobs = Jobs(limits)
        self._views = Views(self._files)
        self._postures = ScenePostures()
        self._work = SceneWork(self._files, self._sent, limits)
        self._set_work = SetWork(self._files, limits)
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

        Drake is imported, the kernel's machine code loaded, a scene built, and what draws imported;
        where there is no machine code yet, it is not compiled. Choosing from files needs none of
        this, and far less memory.

        Args:
            on_end: Called by the thread when it is done, or a step has failed.
        """
        if self._preparation is None:
            steps = (import_scoring, self._work.prepare, *drawing_steps())
            self._preparation = Preparation(steps, on_end)
        return self._preparation

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

    def add_file(self, content: bytes) -> FileEntry:
        """Check a score file that was sent and hold it; nothing in it is called or imported.

        Raises:
            StoreError: If it is not a score file.
            ServiceError: If it is too large.
        """
        return self._files.add(content).entry

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
        from tcs.model.scene import EnvironmentFile
        from tcs.model.scene.changes import environment_text

        with self._files.held(file).lock:
            content = self._files.loaded(file).environment
        where = "environment of the score file"
        environment = checked(content, EnvironmentFile, where, EnvironmentFileError)
        return environment_text(environment, portable=True)

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
        if request.here is None and (request.at or request.torso or request.arm):
            raise ServiceError("'torso', 'at' and 'arm' require 'here'.")
        with self._files.held(request.file).lock:
            file = self._files.loaded(request.file)
            explanation = explain(
                file,
                goal_index(file, request.goal),
                request.configuration
                if request.here is None
                else state_of(request.here, request.torso, request.at, request.arm),
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

    def posture(self, request: PostureRequest) -> dict[str, Any]:
        """Return the scene in space at a base pose, as `tcs.service.postures.ScenePostures.at`.

        Raises:
            NotFoundError: If the score file is not held.
            StoreMismatchError: If the models are not those the file was made from.
            SelectionError: If the base pose is beyond the grid, or there is no such goal.
        """
        file = self._files.for_scene(request.file)
        stated = state_of(request.here, request.torso, request.at)
        import_heavy()
        goal = None if request.goal is None else goal_index(file, request.goal)
        return self._postures.at(request.file, file, stated, goal=goal, arm=request.arm)

    def submit(self, request: JobRequest) -> JobStatus:
        """Queue a job, and return its state.

        Raises:
            BusyError: If the queue is full.
            NotFoundError: If the score file is not held.
            UnknownNameError: If a task, environment, robot or measure of that name does not exist.
        """
        what, work = self._work_of(request)
        return self._jobs.submit(what, work)

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
        return status

    def _work_of(self, request: JobRequest) -> tuple[str, Callable[[Progress], dict[str, Any]]]:
        """Return what a job does and the function that does it, after quick checks."""
        if not isinstance(request, ScoreRequest):
            self._files.held(request.file)
            return self._work_with_file(request)
        if (request.task is None) == (request.task_yaml is None):
            raise ServiceError("give 'task' or 'task_yaml', and not both.")
        check_names(request.task, request.environment, request.robot)
        dexterity(request.measure)
        if isinstance(request, ScoreHereRequest):
            work = partial(self._work.score_here, request)
            return "score-here", self._plainly(work, import_scoring)
        return "score", self._plainly(partial(self._work.score, request), import_scoring)

    def _work_with_file(
        self, request: JobRequest
    ) -> tuple[str, Callable[[Progress], dict[str, Any]]]:
        """Return what a job with a score file does and the function that does it."""
        work: dict[type[Any], tuple[str, Callable[[Any, Progress], dict[str, Any]]]] = {
            EvaluateRequest: ("evaluate", self._work.evaluate),
            PlanRequest: ("plan", self._work.plan),
            SceneRequest: ("scene", self._work.scene),
            PopulationRequest: ("population", self._set_work.population),
            RefineRequest: ("refine", self._set_work.refine),
            MotionsRequest: ("motions", self._set_work.motions),
            RescoreRequest: ("rescore", self._work.rescore),
        }
        what, done = work[type(request)]
        return what, self._plainly(partial(done, request))

    def _plainly(
        self,
        work: Callable[[Progress], dict[str, Any]],
        prepared: Callable[[], None] = import_heavy,
    ) -> Callable[[Progress], dict[str, Any]]:
        """Return work whose result JSON can hold, and whose messages name no temporary folder.

        Args:
            work: The work of a job.
            prepared: Imports what it needs, while no other thread imports the same.
        """

        def done(progress: Progress) -> dict[str, Any]:
            try:
                prepared()
                return dict(without_infinities(work(progress)))
            except UnknownNameError as error:
                where = self._sent.without_folder(error.where)
                raise UnknownNameError(error.what, error.name, error.known, where=where) from None
            except TcsError as error:
                message = self._sent.without_folder(str(error))
                if message == str(error):
                    raise
                raise ServiceError(message) from None

        return done
