"""The engine as tools of an assistant, by the Model Context Protocol; requires `tcs[mcp]`.

Standard input and output carry the messages, so that the assistant starts the program itself.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import anyio
import anyio.to_thread
from mcp import types
from mcp.server import Server
from mcp.server.stdio import stdio_server

from tcs.errors import DataFileError, TcsError, UnknownNameError
from tcs.files.documents import Document, checked
from tcs.service.engine import Engine
from tcs.service.operations import OPERATIONS, Operation

_WAIT = 45.0
"""Time after which the tool of a job returns its state instead of its result [s]: assistants end
calls that take a minute."""
_ABOUT = (
    "Where should an assistive robot stand? List the score files first, or score a task; requests "
    "name a score file by its digest. Metres, and degrees under keys that end in _deg."
)


class JobRequest(Document):
    """A job, by the name that its tool returned."""

    job: str


class NoRequest(Document):
    """Nothing."""


def make_assistant_server(engine: Engine) -> Server[Any]:
    """Return the server whose tools are the requests of the service.

    Args:
        engine: The engine.
    """
    tools = _tools(engine)

    async def on_list_tools(_context: Any, _params: Any) -> types.ListToolsResult:
        return types.ListToolsResult(tools=[tool for tool, _, _ in tools.values()])

    async def on_call_tool(_context: Any, params: Any) -> types.CallToolResult:
        if params.name not in tools:
            return _fault(UnknownNameError("tool", params.name, tools))
        _, model, answer = tools[params.name]
        try:
            request = checked(params.arguments or {}, model, "request", DataFileError)
            result = await anyio.to_thread.run_sync(answer, request, abandon_on_cancel=True)
        except TcsError as error:
            return _fault(error)
        return types.CallToolResult(content=[_text(json.dumps(result, allow_nan=False))])

    return Server(
        "tcs", instructions=_ABOUT, on_list_tools=on_list_tools, on_call_tool=on_call_tool
    )


def serve_assistant(engine: Engine) -> None:
    """Answer an assistant on standard input and output until it closes them."""
    server = make_assistant_server(engine)

    async def run() -> None:
        async with stdio_server() as (incoming, outgoing):
            await server.run(incoming, outgoing, server.create_initialization_options())

    anyio.run(run)


_Tools = dict[str, tuple[types.Tool, type[Document], Callable[[Any], Any]]]


def _tools(engine: Engine) -> _Tools:
    """Return the tools by name, each with the model of its request and what answers it."""
    tools: _Tools = {}

    def add(name: str, about: str, model: type[Document], answer: Callable[[Any], Any]) -> None:
        schema = model.model_json_schema()
        tools[name] = (
            types.Tool(name=name, description=about, input_schema=schema), model, answer,
        )  # fmt: skip

    add("list", "List tasks, environments and robots.", NoRequest, lambda _: engine.catalogue())
    add("files", "List the score files.", NoRequest, lambda _: _files(engine))
    for operation in OPERATIONS:
        add(
            operation.name.replace("-", "_"), operation.summary, operation.request,
            partial(_answer, engine, operation),
        )  # fmt: skip
    add("job", "Return the state and result of a job.", JobRequest, partial(_job, engine))
    add("cancel", "Cancel a job.", JobRequest, lambda one: engine.cancel(one.job).model_dump())
    return tools


def _files(engine: Engine) -> list[dict[str, Any]]:
    return [entry.model_dump() for entry in engine.files()]


def _job(engine: Engine, request: JobRequest) -> dict[str, Any]:
    return engine.job(request.job).model_dump()


def _answer(engine: Engine, operation: Operation, request: Any) -> dict[str, Any]:
    """Return the answer to a request; of a job its state, after it has ended or some time."""
    if not operation.is_job:
        answer: dict[str, Any] = getattr(engine, operation.name)(request)
        return answer
    status, end = engine.submit(request), time.monotonic() + _WAIT
    while not status.has_ended and (left := end - time.monotonic()) > 0.0:
        status = engine.next_state(status.job, status, left)
    return status.model_dump()


def _text(text: str) -> types.TextContent:
    return types.TextContent(type="text", text=text)


def _fault(error: TcsError) -> types.CallToolResult:
    """Return an error: its class and its one line."""
    problem = {"title": type(error).__name__, "detail": " ".join(str(error).splitlines())}
    return types.CallToolResult(content=[_text(json.dumps(problem))], is_error=True)
