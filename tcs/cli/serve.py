"""The command `tcs serve`: answer requests of robots and programs over HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.output import terminal


def serve(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILE]...", help="Score files to hold, made by `tcs score`."),
    ] = None,
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
    jobs: Annotated[
        int, typer.Option(min=1, max=1024, help="Number of threads of a scoring job.")
    ] = 2,
) -> None:
    """Serve the engine over HTTP: score, select, explain, evaluate and plan as requests."""
    from tcs.errors import ServiceError
    from tcs.service import Engine, Limits

    try:
        from tcs.service.http import Server, checked_access, make_application
    except ModuleNotFoundError as error:
        raise ServiceError(
            f"`tcs serve` needs the package {error.name}: pip install 'tcs[service]'."
        ) from None
    access = checked_access(host, token)
    with Engine(Limits(threads=jobs)) as engine:
        for path in files or ():
            entry = engine.open_file(path)
            typer.echo(f"{entry.file} {path}")
        server = Server(make_application(engine, access), host=host, port=port)
        terminal.note(f"{server.url}, requests at {server.url}/docs; Ctrl-C ends.")
        server.run()
