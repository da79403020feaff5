"""Jobs: work that takes longer than a moment, one at a time, with progress and cancellation."""

from __future__ import annotations

import json
import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from tcs.errors import BusyError, CancelledError, NotFoundError, TcsError
from tcs.service.limits import Limits
from tcs.service.responses import JobState, JobStatus

_LOG = logging.getLogger(__name__)


class Progress:
    """Reports the progress of a job, and ends the job where it was cancelled or takes too long."""

    def __init__(self, jobs: Jobs, job: _Job) -> None:
        """Report to the queue of a job."""
        self._jobs, self._job = jobs, job

    def __call__(self, done: int, total: int) -> None:
        """Record the amounts of work done and in all.

        Raises:
            CancelledError: If the job was cancelled, or has reached its longest duration.
        """
        self._jobs.update(self._job, done=done, total=total, note="")

    def check(self) -> None:
        """Raise if the job is to end.

        Raises:
            CancelledError: As above.
        """
        self._jobs.check(self._job)

    def compiling(self) -> None:
        """Record that the kernel is compiled first."""
        self._jobs.update(self._job, note="compiling for this machine, up to a minute")


Work = Callable[[Progress], str]
"""Does the work of a job and returns its result in JSON."""


@dataclass(eq=False)
class _Job:
    """A job and its present state."""

    name: str
    what: str
    work: Work | None
    state: JobState = "queued"
    done: int = 0
    total: int = 0
    note: str = ""
    begun: float = 0.0
    seconds: float = 0.0
    result: str | None = None
    problem: str | None = None
    is_cancelled: bool = False

    def status(self) -> JobStatus:
        """Return the present state without the result."""
        running = self.state == "running"
        return JobStatus(
            job=self.name,
            what=self.what,
            state=self.state,
            done=self.done,
            total=self.total,
            note=self.note,
            seconds=round(time.monotonic() - self.begun if running else self.seconds, 3),
            problem=self.problem,
        )


class Jobs:
    """A queue of jobs and one thread that does them in turn."""

    def __init__(self, limits: Limits) -> None:
        """Start the thread."""
        self._limits = limits
        self._changed = threading.Condition()
        self._waiting: deque[_Job] = deque()
        self._jobs: dict[str, _Job] = {}
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="tcs-jobs", daemon=True)
        self._thread.start()

    def submit(self, what: str, work: Work) -> JobStatus:
        """Queue a job.

        Args:
            what: What it does.
            work: Does the work, and reports its progress.

        Raises:
            BusyError: If the queue is full.
        """
        with self._changed:
            if self._is_closed:
                raise BusyError("the service is shutting down. Send the request to another one.")
            if len(self._waiting) >= self._limits.queued_jobs:
                raise BusyError(
                    f"{len(self._waiting)} jobs are waiting, the most that are queued. Try again "
                    "when one has ended, or cancel one."
                )
            job = _Job(secrets.token_urlsafe(12), what, work)
            self._jobs[job.name] = job
            self._waiting.append(job)
            self._forget()
            self._changed.notify_all()
            return job.status()

    def status(self, name: str) -> JobStatus:
        """Return the state of a job with its result.

        Raises:
            NotFoundError: If there is no such job, or it ended long ago.
        """
        status, result = self._state(name)
        return status.model_copy(update={"result": None if result is None else json.loads(result)})

    def text(self, name: str) -> str:
        """Return the state of a job with its result, in JSON; the result is not read for it.

        Raises:
            NotFoundError: If there is no such job, or it ended long ago.
        """
        status, result = self._state(name)
        text = json.dumps(status.model_dump(exclude={"result"}))
        return f'{text[:-1]}, "result": {result or "null"}}}'

    def all(self) -> list[JobStatus]:
        """Return the states of all jobs, without their results, the oldest first."""
        with self._changed:
            return [job.status() for job in self._jobs.values()]

    def cancel(self, name: str) -> JobStatus:
        """Cancel a job: a waiting one at once, a running one where it next reports its progress.

        Returns:
            Its state, without the result that it may have.

        Raises:
            NotFoundError: If there is no such job.
        """
        with self._changed:
            job = self._job(name)
            job.is_cancelled = True
            if job.state == "queued":
                self._waiting.remove(job)
                self._end(job, "cancelled")
            return job.status()

    def wait_for_change(self, name: str, known: JobStatus | None, seconds: float) -> JobStatus:
        """Return the state of a job, without its result, as soon as it differs from a known one.

        Args:
            name: The job.
            known: The known state; None returns at once.
            seconds: Longest wait [s].

        Raises:
            NotFoundError: If there is no such job.
        """
        end = time.monotonic() + seconds
        with self._changed:
            while True:
                status = self._job(name).status()
                left = end - time.monotonic()
                if known is None or _differ(known, status) or status.has_ended or left <= 0.0:
                    return status
                self._changed.wait(left)

    def update(
        self, job: _Job, *, done: int | None = None, total: int | None = None, note: str = ""
    ) -> None:
        """Record the progress of a job; as `Progress`."""
        with self._changed:
            job.note = note
            if done is not None and total is not None:
                job.done, job.total = int(done), int(total)
            self.check(job)
            self._changed.notify_all()

    def check(self, job: _Job) -> None:
        """Raise if a job is to end; as `Progress`."""
        if job.is_cancelled:
            raise CancelledError("the job was cancelled.")
        if time.monotonic() - job.begun > self._limits.job_seconds:
            raise CancelledError(
                f"the job took longer than {self._limits.job_seconds:g} s, the limit of this "
                "server. Restrict it, e.g. with `only`."
            )

    def close(self) -> None:
        """Cancel every job; the running one ends where it next reports its progress."""
        with self._changed:
            self._is_closed = True
            for job in [*self._waiting]:
                self._waiting.remove(job)
                self._end(job, "cancelled")
            for job in self._jobs.values():
                job.is_cancelled = True
            self._changed.notify_all()

    def _state(self, name: str) -> tuple[JobStatus, str | None]:
        """Return the state of a job, and its result in JSON."""
        with self._changed:
            job = self._job(name)
            return job.status(), job.result

    def _job(self, name: str) -> _Job:
        if name not in self._jobs:
            raise NotFoundError("there is no such job; finished jobs are kept for a while only.")
        return self._jobs[name]

    def _forget(self) -> None:
        """Forget the oldest jobs that have ended, beyond the number that is kept."""
        ended = [name for name, job in self._jobs.items() if job.status().has_ended]
        for name in ended[: max(len(ended) - self._limits.kept_jobs, 0)]:
            del self._jobs[name]

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._waiting and not self._is_closed:
                    self._changed.wait()
                if not self._waiting:
                    return
                job = self._waiting.popleft()
                job.state, job.begun = "running", time.monotonic()
                self._changed.notify_all()
            self._do(job)

    def _do(self, job: _Job) -> None:
        """Do a job; whatever it raises ends the job, not the thread."""
        work, job.work = job.work, None
        assert work is not None
        try:
            result = work(Progress(self, job))
        except Exception as error:
            self._ended(job, *_outcome_of(error, job))
        else:
            self._ended(job, "done", result=result)

    def _ended(
        self,
        job: _Job,
        state: JobState,
        problem: str | None = None,
        *,
        result: str | None = None,
    ) -> None:
        with self._changed:
            job.result, job.problem = result, problem
            job.seconds = time.monotonic() - job.begun
            self._end(job, state)

    def _end(self, job: _Job, state: JobState) -> None:
        job.state, job.note, job.work = state, "", None
        self._changed.notify_all()


def _outcome_of(error: Exception, job: _Job) -> tuple[JobState, str]:
    """Return the state of a job that an exception ended, and the exception in one line."""
    if job.is_cancelled:
        # Work that is cut short may end with another exception than that of its progress.
        return "cancelled", "the job was cancelled."
    if isinstance(error, TcsError):
        return "failed", " ".join(str(error).splitlines())
    _LOG.error("job %s failed", job.what, exc_info=error)
    return "failed", "a defect of the program; see the server's log."


def _differ(first: JobStatus, second: JobStatus) -> bool:
    """Return whether two states differ in more than their duration and the result."""
    only_now = {"seconds": 0.0, "result": None}
    return first.model_copy(update=only_now) != second.model_copy(update=only_now)
