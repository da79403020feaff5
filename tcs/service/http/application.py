"""The application: each request is one call of the engine."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from functools import cache, partial
from typing import Any

import anyio
import anyio.to_thread
from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse, StreamingResponse
from fastapi.routing import APIRoute

from tcs.errors import BusyError, DataFileError, TcsError
from tcs.service.engine import Engine
from tcs.service.http import description
from tcs.service.http.description import problem, problem_of
from tcs.service.http.file_queues import FileQueues
from tcs.service.http.guard import Access, Guard
from tcs.service.limits import SMALL_REQUEST
from tcs.service.operations import OPERATIONS, Operation
from tcs.service.responses import JobStatus
from tcs.service.sent_documents import request_of

_ABOUT = (
    "Where should an assistive robot stand? Requests have the options of the command line with the "
    "same names, and answers the keys that it prints with --json. A request names a score file by "
    "the SHA-256 of its content: send one with POST /v1/files, or make one with POST /v1/score. "
    "Metres, and degrees under keys that end in _deg."
)
_LOOKING = 8
"""Most threads that wait for the processes that pose scenes."""
_BEAT = 10.0
"""Longest time between two events of a stream [s]."""
_FILE, _JSON = "application/octet-stream", "application/json"
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'{more}; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'; sandbox allow-scripts allow-popups allow-downloads allow-modals"
)
"""Of a page whose scripts are in itself. It has no origin, so that a text of a score file that were
run in it could neither ask this service nor send anything elsewhere."""
_REPORT = {"Content-Security-Policy": _POLICY.format(more="")}
_VIEW = {"Content-Security-Policy": _POLICY.format(more="; connect-src data: blob:")}
"""Meshcat fetches its scene out of the page."""


class PlainRoute(APIRoute):
    """A route whose function takes the request and returns the response.

    FastAPI's search for the values of parameters, which such a function has none of, takes as long
    as a third of a selection.
    """

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the function itself."""
        endpoint: Callable[[Request], Coroutine[Any, Any, Response]] = self.endpoint
        return endpoint


def make_application(engine: Engine, access: Access) -> FastAPI:
    """Return the application that answers requests with an engine.

    Args:
        engine: The engine.
        access: Who may send requests.
    """
    app = FastAPI(
        title="tcs service", description=_ABOUT, docs_url=None, redoc_url=None, openapi_url=None
    )
    app.add_middleware(Guard, access=access, limits=engine.limits)
    app.add_exception_handler(TcsError, _on_error)
    app.add_exception_handler(404, _on_unknown_path)
    app.add_exception_handler(405, _on_unknown_path)
    queues = FileQueues()
    # What waits to be read takes no thread from other requests.
    reading = anyio.CapacityLimiter(engine.limits.parsing)
    looking = anyio.CapacityLimiter(_LOOKING)
    for operation in OPERATIONS:
        _add_operation(app, engine, operation, queues, reading, looking)
    _add_files(app, engine, reading, looking)
    _add_jobs(app, engine)
    _add_description(app, engine)
    return app


async def _on_error(_request: Request, error: Exception) -> Response:
    assert isinstance(error, TcsError)
    return problem_of(error)


async def _on_unknown_path(request: Request, _error: Exception) -> Response:
    path = request.url.path[:80]
    return problem(404, "NotFoundError", f"there is no {request.method} {path}. See /docs.")


def _add_operation(
    app: FastAPI,
    engine: Engine,
    operation: Operation,
    queues: FileQueues,
    reading: anyio.CapacityLimiter,
    looking: anyio.CapacityLimiter,
) -> None:
    """Add a request with a body of JSON."""

    async def endpoint(request: Request) -> Response:
        content = await _json_of(request)
        if len(content) <= SMALL_REQUEST:
            checked_request = request_of(operation.request, content)
        else:
            checked_request = await anyio.to_thread.run_sync(
                engine.request_of, operation.request, content, limiter=reading
            )
        is_large = len(content) > SMALL_REQUEST
        if operation.takes_turns and (is_large or operation.is_long(checked_request)):
            # So that nobody waits for it who asks about the same file, or anything else.
            return await apart(checked_request, reading)
        if operation.takes_turns:
            kind, answer = operation.kind_of(checked_request), getattr(engine, operation.name)
            text = await queues.run(
                checked_request.file, kind, lambda: _text(answer(checked_request))
            )
            return Response(text, media_type=_JSON)
        if not operation.is_job:
            return await apart(checked_request, looking)
        status = await anyio.to_thread.run_sync(engine.submit, checked_request)
        return _json(status.model_dump(), status=202)

    async def apart(checked_request: Any, limiter: anyio.CapacityLimiter) -> Response:
        text = await anyio.to_thread.run_sync(
            engine.answer_apart, operation.name, checked_request, limiter=limiter
        )
        return Response(text, media_type=_JSON)

    app.router.add_api_route(
        operation.path, endpoint, methods=["POST"], summary=operation.summary,
        response_model=None, name=operation.name, route_class_override=PlainRoute,
        responses={422: description.problem_response("The request is refused.")},
        openapi_extra={"requestBody": description.body_of(operation.request.__name__)},
    )  # fmt: skip


def _add_files(
    app: FastAPI,
    engine: Engine,
    reading: anyio.CapacityLimiter,
    looking: anyio.CapacityLimiter,
) -> None:
    """Add the requests about score files, and the catalogue."""

    async def known() -> Response:
        return _json(await anyio.to_thread.run_sync(engine.catalogue))

    async def files() -> Response:
        return _json([entry.model_dump() for entry in engine.files()])

    async def send(request: Request) -> Response:
        parts = [part async for part in request.stream()]
        entry = await anyio.to_thread.run_sync(engine.add_file, parts, limiter=reading)
        return _json(entry.model_dump(), status=201)

    async def fetch(file: str) -> Response:
        content = await anyio.to_thread.run_sync(engine.content_of, file)
        return Response(content, media_type=_FILE)

    async def view(file: str) -> Response:
        return HTMLResponse(await anyio.to_thread.run_sync(engine.view_of, file), headers=_VIEW)

    async def environment(file: str) -> Response:
        text = await anyio.to_thread.run_sync(engine.environment_of, file, limiter=looking)
        return Response(text, media_type="application/yaml")

    async def report(file: str) -> Response:
        content = await anyio.to_thread.run_sync(engine.report_of, file)
        return HTMLResponse(content, headers=_REPORT)

    body = {"required": True, "content": {_FILE: {"schema": {"type": "string"}}}}
    _route(app, "GET", "/v1/list", known, "List tasks, environments and robots.")
    _route(app, "GET", "/v1/files", files, "List the score files that are held.")
    _route(
        app, "POST", "/v1/files", send, "Send a score file, as the content of the request.",
        openapi_extra={"requestBody": body},
    )  # fmt: skip
    _route(app, "GET", "/v1/files/{file}", fetch, "Fetch a score file.")
    _route(
        app, "GET", "/v1/files/{file}/environment", environment,
        "Fetch the environment of a score file, as YAML.",
    )  # fmt: skip
    _route(app, "GET", "/v1/files/{file}/report", report, "Return the report, as a page.")
    _route(app, "GET", "/v1/files/{file}/view", view, "Return a page with the scene in 3-D.")


def _add_jobs(app: FastAPI, engine: Engine) -> None:
    """Add the requests about jobs."""
    streams = 0
    # Streams wait in threads of their own, so that they keep no other request waiting.
    threads = anyio.CapacityLimiter(engine.limits.streams)

    async def jobs() -> Response:
        return _json([status.model_dump() for status in engine.jobs()])

    async def job(job: str) -> Response:
        return Response(engine.job_text(job), media_type=_JSON)

    async def cancel(job: str) -> Response:
        engine.cancel(job)
        return Response(engine.job_text(job), media_type=_JSON)

    async def events(job: str) -> Response:
        nonlocal streams
        status = engine.next_state(job, None, 0.0)
        if streams >= engine.limits.streams:
            raise BusyError(f"{streams} streams of events are open, the most at once.")
        streams += 1

        async def closing() -> AsyncIterator[str]:
            nonlocal streams
            try:
                async for event in _events(engine, status, threads):
                    yield event
            finally:
                streams -= 1

        return StreamingResponse(closing(), media_type="text/event-stream")

    _route(app, "GET", "/v1/jobs", jobs, "List the jobs, without their results.")
    _route(app, "GET", "/v1/jobs/{job}", job, "Return the state of a job and its result.")
    _route(app, "DELETE", "/v1/jobs/{job}", cancel, "Cancel a job.", name="cancel")
    _route(
        app, "GET", "/v1/jobs/{job}/events", events,
        "Return the states of a job as server-sent events, until it has ended.",
    )  # fmt: skip


async def _events(
    engine: Engine, status: JobStatus, threads: anyio.CapacityLimiter
) -> AsyncIterator[str]:
    """Yield the states of a job as events named `progress`, and the last one as `end`."""
    while True:
        name = "end" if status.has_ended else "progress"
        yield f"event: {name}\ndata: {engine.job_text(status.job)}\n\n"
        if status.has_ended:
            return
        wait = partial(engine.next_state, status.job, status, _BEAT)
        # A stream that is closed must not wait for the job.
        status = await anyio.to_thread.run_sync(wait, abandon_on_cancel=True, limiter=threads)


def _add_description(app: FastAPI, engine: Engine) -> None:
    """Add the OpenAPI description and its page."""
    described: dict[str, Any] = {}

    def openapi() -> dict[str, Any]:
        if not described:
            described.update(FastAPI.openapi(app))
            described["components"] = {"schemas": description.schemas()}
        return described

    @cache
    def text_of(path: str) -> str:
        return _text(openapi()) if path == "/openapi.json" else description.page(openapi())

    # Each takes as long as many requests; it is made once, and not where they are answered.
    async def specification() -> Response:
        text = await anyio.to_thread.run_sync(text_of, "/openapi.json")
        return Response(text, media_type=_JSON)

    async def page() -> Response:
        text = await anyio.to_thread.run_sync(text_of, "/docs")
        return HTMLResponse(text, headers=_REPORT)

    async def about() -> Response:
        from tcs import __version__

        return _json({"program": "tcs", "version": __version__, "docs": "/docs"})

    app.openapi = openapi  # type: ignore[method-assign]
    app.add_api_route("/openapi.json", specification, include_in_schema=False)
    app.add_api_route("/docs", page, include_in_schema=False)
    _route(app, "GET", "/v1", about, "Return the version of the service.")


def _route(
    app: FastAPI,
    verb: str,
    path: str,
    endpoint: Callable[..., Awaitable[Response]],
    summary: str,
    **options: Any,
) -> None:
    app.add_api_route(
        path, endpoint, methods=[verb], summary=summary, response_model=None,
        responses={422: description.problem_response("The request is refused.")}, **options,
    )  # fmt: skip


async def _json_of(request: Request) -> bytes:
    """Return the content of a request in JSON.

    Raises:
        DataFileError: If it is of another type.
    """
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if media_type != _JSON:
        raise DataFileError("request: the content type must be application/json.")
    return await request.body()


def _json(content: Any, status: int = 200) -> Response:
    return Response(_text(content), status_code=status, media_type=_JSON)


def _text(content: Any) -> str:
    return json.dumps(content, allow_nan=False)
