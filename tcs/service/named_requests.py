"""The requests of the service by name, with JSON objects in and out: for MCP and for ROS."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from tcs.errors import DataFileError, TcsError, UnknownNameError
from tcs.files.documents import Document, checked
from tcs.service.engine import Engine
from tcs.service.operations import OPERATIONS, Operation


class JobName(Document):
    """A job, by the name that its request returned."""

    job: str


class NoFields(Document):
    """Nothing."""


@dataclass(frozen=True, slots=True)
class NamedRequest:
    """A request that is sent by name."""

    name: str
    """Its name, e.g. "score_here"."""
    about: str
    """What it does, in a sentence."""
    model: type[Document]
    """Model of its fields."""
    answer: Callable[[Any], Any]
    """Returns the answer to a checked request, as containers that JSON can hold."""


class NamedRequests:
    """The requests of an engine by name."""

    def __init__(self, engine: Engine, *, job_seconds: float) -> None:
        """Answer with an engine.

        Args:
            engine: The engine.
            job_seconds: Time after which the request of a job is answered with its state, if the
                job has not ended [s].
        """
        self._engine, self._job_seconds = engine, job_seconds
        found = [
            NamedRequest(
                "list", "List tasks, environments and robots.", NoFields,
                lambda _: engine.catalogue(),
            ),
            NamedRequest("files", "List the score files.", NoFields, self._files),
            *(
                NamedRequest(
                    one.name.replace("-", "_"), one.summary, one.request,
                    partial(self._answer_of, one),
                )
                for one in OPERATIONS
            ),
            NamedRequest("job", "Return the state and result of a job.", JobName, self._job),
            NamedRequest("cancel", "Cancel a job.", JobName, self._cancel),
        ]  # fmt: skip
        self._requests = {one.name: one for one in found}

    def __iter__(self) -> Iterator[NamedRequest]:
        """Iterate over the requests."""
        return iter(self._requests.values())

    def checked(self, name: str, fields: Mapping[str, Any]) -> Document:
        """Return a request with checked fields.

        Raises:
            UnknownNameError: If there is no request of that name.
            DataFileError: If a field is unknown or not of its form.
        """
        if name not in self._requests:
            raise UnknownNameError("request", name, self._requests)
        return checked(fields, self._requests[name].model, "request", DataFileError)

    def answer(self, name: str, fields: Mapping[str, Any]) -> Any:
        """Return the answer to a request, as containers that JSON can hold.

        Raises:
            UnknownNameError: If there is no request of that name.
            DataFileError: If a field is unknown or not of its form.
            TcsError: As the method of the engine.
        """
        request = self.checked(name, fields)
        return self._requests[name].answer(request)

    def _files(self, _request: Any) -> list[dict[str, Any]]:
        return [entry.model_dump() for entry in self._engine.files()]

    def _job(self, request: JobName) -> dict[str, Any]:
        return self._engine.job(request.job).model_dump()

    def _cancel(self, request: JobName) -> dict[str, Any]:
        return self._engine.cancel(request.job).model_dump()

    def _answer_of(self, operation: Operation, request: Any) -> dict[str, Any]:
        """Return the answer to a request; of a job its state, after it has ended or some time."""
        if not operation.is_job:
            answer: dict[str, Any] = getattr(self._engine, operation.name)(request)
            return answer
        status, end = self._engine.submit(request), time.monotonic() + self._job_seconds
        while not status.has_ended and (left := end - time.monotonic()) > 0.0:
            status = self._engine.next_state(status.job, status, left)
        return self._engine.job(status.job).model_dump()


def named_problem(error: TcsError) -> dict[str, str]:
    """Return the class of an error and its one line, as "title" and "detail"."""
    return {"title": type(error).__name__, "detail": " ".join(str(error).splitlines())}
