"""Responses of the service that have no counterpart on the command line."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

JobState = Literal["queued", "running", "done", "failed", "cancelled"]
ENDED: tuple[JobState, ...] = ("done", "failed", "cancelled")
"""States of jobs that have ended."""


class FileEntry(BaseModel):
    """A score file that the service holds."""

    model_config = ConfigDict(frozen=True)

    file: str
    """SHA-256 of its content, by which requests name it."""
    bytes: int
    """Its size."""
    task: str
    """Name of the task."""
    environment: str
    """Name of the environment."""
    robot: str
    """Name of the robot."""
    title: str
    """Task, environment, robot, and the person if it is not that of the environment."""
    goals: int
    """Number of goals."""
    configurations: int
    """Number of configurations of its grid."""
    settings: list[str]
    """Axes of the environment, by the keys of `at`, e.g. "bed_height" or "head_rest_deg"."""
    body_frames: list[str]
    """Body frames that may be observed, by the keys of `frames`, e.g. "head"."""


class JobStatus(BaseModel):
    """A job: what it does, how far it is, and its result."""

    model_config = ConfigDict(frozen=True)

    job: str
    """Its name."""
    what: str
    """What it does: the name of the request, e.g. score-here or plan."""
    state: JobState
    """`done`, `failed` and `cancelled` are final."""
    done: int = 0
    """Amount of work done."""
    total: int = 0
    """Amount of work in all; 0 before it is known."""
    note: str = ""
    """What the job does before it counts, such as compiling."""
    seconds: float = 0.0
    """Duration so far [s], without the wait in the queue."""
    result: dict[str, Any] | None = None
    """The object that the command prints with `--json`, of a job that is done."""
    problem: str | None = None
    """Why it failed, in one line."""

    @property
    def has_ended(self) -> bool:
        """Whether the state is final."""
        return self.state in ENDED


class ProblemDetails(BaseModel):
    """An error, as `application/problem+json` (RFC 9457)."""

    title: str
    """Class of the error, e.g. "SelectionError"."""
    status: int
    """Status of the response."""
    detail: str
    """What is wrong, where, what is allowed and what to do next, in one line."""
