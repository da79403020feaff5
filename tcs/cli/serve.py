"""The commands `tcs serve` and `tcs app`: the service for programs, and the page for people."""

from __future__ import annotations

import threading
import warnings
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs.service import Engine

Files = Annotated[
    list[Path] | None,
    typer.Argument(metavar="[FILE]...", help="Score files to hold, made by `tcs score`."),
]


def serve(
    files: Files = None,
    host: Annotated[
        str,
        typer.Option(help="Address to listen at; other than of this machine requires a token."),
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen at; 0 for a free one.")
    ] = 8000,
    token: Annotated[
        str | None,
        typer.Option(
            envvar="TCS_TOKEN",
            help="Text that requests must carry as `Authorization: Bearer TOKEN`. Prefer the "
            "variable: other users can read the command line.",
            show_default=False,
        ),
    ] = None,
    assistant: Annotated[
        bool,
        typer.Option(
            "--mcp",
            help="Answer an assistant on standard input and output, by the Model Context Protocol.",
        ),
    ] = False,
    jobs: options.Jobs = 2,
) -> None:
    """Serve the engine over HTTP: score, select, explain, evaluate and plan as requests."""
    if assistant:
        _serve_assistant(files, jobs)
        return
    http = _http("serve")
    access = http.checked_access(host, token)
    with _engine(files, jobs, typer.echo) as engine:
        server = http.Server(http.make_application(engine, access), host=host, port=port)
        terminal.note(f"{server.url}, requests at {server.url}/docs; Ctrl-C ends.")
        server.run()


@expand_options
def app(
    files: Files = None,
    *,
    window: options.WindowOptions,
    jobs: options.Jobs = 2,
) -> None:
    """Open the page for people: pick a task, click a place, read what can be done from there."""
    http = _http("app")
    from tcs.app import add_page

    with _engine(files, jobs, terminal.note) as engine:
        application = http.make_application(engine, http.Access())
        add_page(application)
        server = http.Server(application, host="127.0.0.1", port=window.port or 0)
        terminal.note(f"open {server.url} in a browser; Ctrl-C ends.")
        if window.browser:
            # Opening a browser may wait for the browser.
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        server.run(window.duration)


def _serve_assistant(files: list[Path] | None, jobs: int) -> None:
    """Answer an assistant until it closes standard input.

    Raises:
        ServiceError: If a package that this needs is not installed.
    """
    from tcs.errors import ServiceError

    try:
        from tcs.service.assistant import serve_assistant
    except ModuleNotFoundError as error:
        raise ServiceError(
            f"`tcs serve --mcp` needs the package {error.name}: pip install 'tcs[mcp]'."
        ) from None
    with _engine(files, jobs, terminal.note) as engine:
        serve_assistant(engine)


def _http(command: str) -> Any:
    """Return the package of the server.

    Raises:
        ServiceError: If a package that it needs is not installed.
    """
    from tcs.errors import ServiceError

    try:
        from tcs.service import http
    except ModuleNotFoundError as error:
        extra = "app" if command == "app" else "service"
        raise ServiceError(
            f"`tcs {command}` needs the package {error.name}: pip install 'tcs[{extra}]'."
        ) from None
    return http


@contextmanager
def _engine(
    files: list[Path] | None, jobs: int, on_line: Callable[[str], None]
) -> Iterator[Engine]:
    """Yield an engine that holds the files, and name each with its digest."""
    from tcs.service import Engine, Limits

    # Of a job that is cancelled, joblib reports the parts whose results are not used.
    warnings.filterwarnings("ignore", category=UserWarning, module="joblib")
    with Engine(Limits(threads=jobs)) as engine:
        for path in files or ():
            on_line(f"{engine.open_file(path).file} {path}")
        yield engine
