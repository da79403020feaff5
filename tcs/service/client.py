"""A client of the service over HTTP, with the methods of `Engine`; requires `tcs[service]`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import httpx

from tcs.errors import BusyError, NotFoundError, ServiceError, StoreError
from tcs.files.documents import Document
from tcs.files.reading import read_bytes
from tcs.service.limits import Limits
from tcs.service.operations import OPERATIONS
from tcs.service.requests import (
    ExplainRequest,
    FloorRequest,
    JobRequest,
    OutcomeRequest,
    PostureRequest,
    SelectRequest,
)
from tcs.service.responses import FileEntry, JobStatus

_PATHS = {one.request: one.path for one in OPERATIONS}
_ERRORS = {404: NotFoundError, 503: BusyError}


class Client:
    """Sends requests to a server of `tcs serve`; a context manager that closes its connections."""

    def __init__(
        self, url: str = "http://127.0.0.1:8000", token: str | None = None, seconds: float = 60.0
    ) -> None:
        """Send requests to the server at an address.

        Args:
            url: Address of the server.
            token: Its token, if it has one.
            seconds: Longest wait for an answer [s].
        """
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        # A proxy of the environment is not for a robot's own machine.
        self._http = httpx.Client(
            base_url=url, headers=headers, timeout=seconds, trust_env=False, follow_redirects=False
        )

    def __enter__(self) -> Self:
        """Return the client."""
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Close the connections."""
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def catalogue(self) -> dict[str, Any]:
        """Return the tasks, environments and robots of the server.

        Raises:
            ServiceError: As of every method, if the server does not answer or refuses.
        """
        return dict(self._answer("GET", "/v1/list"))

    def files(self) -> list[FileEntry]:
        """Return the score files that the server holds."""
        return [FileEntry(**entry) for entry in self._answer("GET", "/v1/files")]

    def add_file(self, content: bytes) -> FileEntry:
        """Send a score file."""
        return FileEntry(**self._answer("POST", "/v1/files", content=content))

    def send_file(self, path: Path) -> FileEntry:
        """Send a score file of this machine.

        Raises:
            StoreError: If it cannot be read.
        """
        limit = Limits().file_bytes
        return self.add_file(read_bytes(path, f"Score file '{path}'", StoreError, limit=limit))

    def content_of(self, file: str) -> bytes:
        """Return the bytes of a score file.

        Raises:
            NotFoundError: If the server does not hold it.
        """
        return self._response("GET", f"/v1/files/{file}").content

    def environment_of(self, file: str) -> str:
        """Return the environment of a score file as YAML, as `Engine.environment_of`."""
        return self._response("GET", f"/v1/files/{file}/environment").text

    def view_of(self, file: str) -> bytes:
        """Return a page with the scene in 3-D, as `Engine.view_of`."""
        return self._response("GET", f"/v1/files/{file}/view").content

    def report_of(self, file: str) -> bytes:
        """Return the report of a score file as a page, as `Engine.report_of`."""
        return self._response("GET", f"/v1/files/{file}/report").content

    def select(self, request: SelectRequest) -> dict[str, Any]:
        """Return the set with the greatest utility, as `Engine.select`."""
        return dict(self._post(request))

    def explain(self, request: ExplainRequest) -> dict[str, Any]:
        """Return why a goal is not reached and the cheapest change, as `Engine.explain`."""
        return dict(self._post(request))

    def floor(self, request: FloorRequest) -> dict[str, Any]:
        """Return the best scores at each base position, as `Engine.floor`."""
        return dict(self._post(request))

    def outcome(self, request: OutcomeRequest) -> dict[str, Any]:
        """Return what is reached from a base pose, as `Engine.outcome`."""
        return dict(self._post(request))

    def posture(self, request: PostureRequest) -> dict[str, Any]:
        """Return the scene in space at a base pose, as `Engine.posture`."""
        return dict(self._post(request))

    def submit(self, request: JobRequest) -> JobStatus:
        """Queue a job, and return its state.

        Raises:
            BusyError: If the queue is full.
        """
        return JobStatus(**self._post(request))

    def jobs(self) -> list[JobStatus]:
        """Return the states of all jobs without their results, the oldest first."""
        return [JobStatus(**status) for status in self._answer("GET", "/v1/jobs")]

    def job(self, name: str) -> JobStatus:
        """Return the state of a job, with its result if it is done.

        Raises:
            NotFoundError: If there is no such job.
        """
        return JobStatus(**self._answer("GET", f"/v1/jobs/{name}"))

    def cancel(self, name: str) -> JobStatus:
        """Cancel a job: a waiting one at once, a running one where it next reports its progress.

        Raises:
            NotFoundError: If there is no such job.
        """
        return JobStatus(**self._answer("DELETE", f"/v1/jobs/{name}"))

    def wait(self, name: str, on_progress: Callable[[int, int], None] | None = None) -> JobStatus:
        """Wait until a job has ended, and return its state.

        Args:
            name: The job.
            on_progress: Called with the amounts of work done and in all, whenever they change.

        Raises:
            NotFoundError: If there is no such job.
        """
        for status in self._events(name):
            if status.has_ended:
                return status
            if on_progress is not None and status.total:
                on_progress(status.done, status.total)
        raise ServiceError("the server ended before the job did. Send the request again.")

    def _events(self, name: str) -> Iterator[JobStatus]:
        """Yield the states of a job as they change."""
        try:
            with self._http.stream("GET", f"/v1/jobs/{name}/events") as response:
                if response.is_error:
                    response.read()
                    raise _error_of(response)
                for line in response.iter_lines():
                    if line.startswith("data: "):
                        yield JobStatus(**json.loads(line.removeprefix("data: ")))
        except httpx.HTTPError as error:
            raise _silent(self._http, error) from None

    def _post(self, request: Document) -> Any:
        content = request.model_dump_json(exclude_unset=True).encode()
        path = _PATHS[type(request)]
        return self._answer("POST", path, content=content, type_="application/json")

    def _answer(
        self, verb: str, path: str, *, content: bytes | None = None, type_: str = ""
    ) -> Any:
        return self._response(verb, path, content=content, type_=type_).json()

    def _response(
        self, verb: str, path: str, *, content: bytes | None = None, type_: str = ""
    ) -> httpx.Response:
        headers = {"Content-Type": type_} if type_ else None
        try:
            response = self._http.request(verb, path, content=content, headers=headers)
        except httpx.HTTPError as error:
            raise _silent(self._http, error) from None
        if response.is_error:
            raise _error_of(response)
        return response


def _silent(http: httpx.Client, error: httpx.HTTPError) -> ServiceError:
    return ServiceError(f"the server {http.base_url} does not answer: {error or 'no response'}.")


def _error_of(response: httpx.Response) -> ServiceError:
    """Return the error of a response, with the one line of the server."""
    try:
        detail = str(response.json()["detail"])
    except (ValueError, KeyError, TypeError):
        detail = f"the server answered with status {response.status_code}."
    return _ERRORS.get(response.status_code, ServiceError)(detail)
