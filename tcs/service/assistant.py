"""The engine as tools of an assistant, by the Model Context Protocol; requires `tcs[mcp]`.

Standard input and output carry the messages, so that the assistant starts the program itself.
"""

from __future__ import annotations

import json
from functools import partial
from typing import Any

import anyio
import anyio.to_thread
from mcp import types
from mcp.server import Server
from mcp.server.stdio import stdio_server

from tcs.errors import TcsError
from tcs.service.engine import Engine
from tcs.service.named_requests import NamedRequests, named_problem

_WAIT = 45.0
"""Time after which the tool of a job returns its state instead of its result [s]: assistants end
calls that take a minute."""
_ABOUT = (
    "Where should an assistive robot stand? List the score files first, or score a task; requests "
    "name a score file by its digest. Metres, and degrees under keys that end in _deg."
)


def make_assistant_server(engine: Engine, *, job_seconds: float = _WAIT) -> Server[Any]:
    """Return the server whose tools are the requests of the service.

    Args:
        engine: The engine.
        job_seconds: Time after which the tool of a job returns its state instead of its result [s].
    """
    requests = NamedRequests(engine, job_seconds=job_seconds)
    tools = [
        types.Tool(name=one.name, description=one.about, input_schema=one.model.model_json_schema())
        for one in requests
    ]

    async def on_list_tools(_context: Any, _params: Any) -> types.ListToolsResult:
        return types.ListToolsResult(tools=tools)

    async def on_call_tool(_context: Any, params: Any) -> types.CallToolResult:
        answer = partial(requests.answer, params.name, params.arguments or {})
        try:
            result = await anyio.to_thread.run_sync(answer, abandon_on_cancel=True)
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


def _text(text: str) -> types.TextContent:
    return types.TextContent(type="text", text=text)


def _fault(error: TcsError) -> types.CallToolResult:
    """Return an error: its class and its one line."""
    return types.CallToolResult(content=[_text(json.dumps(named_problem(error)))], is_error=True)
