"""The commands `tcs serve` and `tcs app`: the service for programs, and the page for people."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import urlencode

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs.service import Engine
    from tcs.service.ros import FrameNames

Files = Annotated[
    list[Path] | None,
    typer.Argument(metavar="[FILE]...", help="Score files to hold, made by `tcs score`."),
]


@dataclass(frozen=True, kw_only=True)
class _FrameOptions:
    """Options of the frames in tf."""

    environment_frame: Annotated[
        str, typer.Option(help="Frame in tf that is the origin of the environment, z up.")
    ] = "environment"
    base_frame: Annotated[
        str, typer.Option(help="Frame in tf of the robot's base on the floor.")
    ] = "base_footprint"
    person_frame: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BODY=FRAME",
            help="Frame in tf of a body frame of the person, e.g. head=human/head; may be "
            "repeated.",
        ),
    ] = None
    max_age: Annotated[
        float, typer.Option(min=0.0, help="Longest age of a transform that is not static (s).")
    ] = 5.0

    def names(self) -> FrameNames:
        """Return the names of the frames.

        Raises:
            typer.BadParameter: If a frame of the person is not of its form, or given twice.
        """
        from tcs.service.ros import FrameNames

        person: dict[str, str] = {}
        for text in self.person_frame or ():
            body, equals, frame = text.partition("=")
            if not (body and equals and frame) or body in person:
                raise typer.BadParameter(
                    f"'{text}' must be BODY=FRAME, each body frame once.",
                    param_hint="--person-frame",
                )
            person[body] = frame
        return FrameNames(environment=self.environment_frame, base=self.base_frame, person=person)


_OF_MODES = {
    ("HTTP",): ("host", "port", "token"),
    ("--ros2",): ("router",),
    ("--ros1", "--ros2"): ("environment_frame", "base_frame", "person_frame", "max_age"),
    ("HTTP", "--ros1", "--ros2"): ("prepare",),
}
"""Options by the modes that they are for."""


def _check_options(context: typer.Context, mode: str) -> None:
    """Refuse options of other modes than the one that is served.

    Raises:
        typer.BadParameter: If one is given on the command line.
    """
    for modes, names in _OF_MODES.items():
        for name in names:
            source = context.get_parameter_source(name)
            given = source is not None and source.name == "COMMANDLINE"
            if given and mode not in modes:
                option = f"--{name.replace('_', '-')}"
                raise typer.BadParameter(
                    f"is for {' and '.join(modes)}, not for {mode}. Leave it out.",
                    param_hint=option,
                )


@expand_options
def serve(
    context: typer.Context,
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
    ros1: Annotated[
        bool, typer.Option("--ros1", help="Answer as a node of ROS 1, with the services of /tcs.")
    ] = False,
    ros2: Annotated[
        bool,
        typer.Option(
            "--ros2",
            help="Answer as a node of ROS 2, with the services and actions of /tcs; ROS need not "
            "be installed.",
        ),
    ] = False,
    router: Annotated[
        str, typer.Option(help="With --ros2: address of the router of rmw_zenoh.")
    ] = "tcp/localhost:7447",
    prepare: Annotated[
        bool,
        typer.Option(
            "--prepare/--no-prepare",
            help="Import Drake, load the kernel and build a scene before it says that it is ready, "
            "so that the first job need not; without, less memory is used until then. Not with "
            "--mcp.",
        ),
    ] = True,
    *,
    frames: _FrameOptions,
    jobs: options.Jobs = 2,
) -> None:
    """Serve the engine over HTTP: score, select, explain, evaluate and plan as requests."""
    if assistant + ros1 + ros2 > 1:
        raise typer.BadParameter("give one of them.", param_hint="--mcp, --ros1, --ros2")
    mode = "--mcp" if assistant else "--ros1" if ros1 else "--ros2" if ros2 else "HTTP"
    _check_options(context, mode)
    if assistant:
        _serve_assistant(files, jobs)
        return
    if ros1:
        _serve_ros1(files, frames, jobs, prepare=prepare)
        return
    if ros2:
        _serve_ros2(files, frames, router, jobs, prepare=prepare)
        return
    http = _http("serve")
    access = http.checked_access(host, token)
    with _engine(files, jobs, typer.echo) as engine:

        def listening() -> None:
            ready = f"{server.url}, requests at {server.url}/docs; Ctrl-C ends."
            _say_ready(engine, ready, prepare=prepare)

        application = http.make_application(engine, access)
        server = http.Server(application, host=host, port=port, on_listening=listening)
        server.run()


@expand_options
def app(
    files: Files = None,
    *,
    window: options.WindowOptions,
    jobs: options.Jobs = 2,
) -> None:
    """Open the page for people: pick a task, click a place, read what can be done from there."""
    open_page(files, window, jobs)


def open_page(
    files: list[Path] | None,
    window: options.WindowOptions,
    jobs: int,
    *,
    command: str = "app",
    first: Mapping[str, str] = MappingProxyType({}),
) -> None:
    """Serve the page for people until it is interrupted, and open it in a browser.

    Args:
        files: Score files to hold.
        window: Where it is served and for how long.
        jobs: Number of threads.
        command: The command that opens it, for messages.
        first: What is shown first, as in the address of the page; of the first file.

    Raises:
        ServiceError: If a package that it needs is not installed.
    """
    http = _http(command)
    from tcs.app import add_page

    with _engine(files, jobs, terminal.note) as engine:
        application = http.make_application(engine, http.Access())
        add_page(application)
        server = http.Server(
            application, host="127.0.0.1", port=window.port or 0, on_listening=engine.prepare
        )
        address = server.url
        if first:
            address += f"/#{urlencode({'file': engine.files()[0].file, **first})}"
        terminal.note(f"open {address} in a browser; Ctrl-C ends.")
        if window.browser:
            # Opening a browser may wait for the browser.
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
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


def _serve_ros1(
    files: list[Path] | None, frames: _FrameOptions, jobs: int, *, prepare: bool
) -> None:
    """Answer as a node of ROS 1 until interrupted.

    Raises:
        ServiceError: If a package of ROS 1 is not installed, or no master answers.
    """
    from tcs.service.ros.ros1 import Ros1Node

    names = frames.names()
    with (
        _engine(files, jobs, typer.echo) as engine,
        Ros1Node(engine, names, max_age=frames.max_age) as node,
    ):
        ready = "the services of ROS 1 are at /tcs: `rosservice list`; Ctrl-C ends."
        _say_ready(engine, ready, prepare=prepare)
        node.run()


def _serve_ros2(
    files: list[Path] | None, frames: _FrameOptions, router: str, jobs: int, *, prepare: bool
) -> None:
    """Answer as a node of ROS 2 until interrupted.

    Raises:
        ServiceError: If a package that this needs is not installed, or Zenoh cannot be opened.
    """
    from tcs.errors import ServiceError

    try:
        from tcs.service.ros.ros2 import Ros2Node, domain_of_environment
        from tcs.service.ros.ros2_entities import zenoh_config
    except ModuleNotFoundError as error:
        raise ServiceError(
            f"`tcs serve --ros2` needs the package {error.name}: pip install 'tcs[ros2]'."
        ) from None
    names, domain = frames.names(), domain_of_environment()
    with (
        _engine(files, jobs, typer.echo) as engine,
        Ros2Node(
            engine, names, zenoh_config(router), max_age=frames.max_age, domain=domain
        ) as node,
    ):
        ready = f"the services of ROS 2 are at /tcs, domain {domain}, router {router}; Ctrl-C ends."
        _say_ready(engine, ready, prepare=prepare)
        node.run()


def _say_ready(engine: Engine, line: str, *, prepare: bool) -> None:
    """Print that requests are answered, and first prepare for the jobs; returns at once."""
    say = partial(terminal.note, line)
    if prepare:
        engine.prepare(say)
    else:
        say()


def _http(command: str) -> Any:
    """Return the package of the server.

    Raises:
        ServiceError: If a package that it needs is not installed.
    """
    from tcs.errors import ServiceError

    try:
        from tcs.service import http
    except ModuleNotFoundError as error:
        extra = "service" if command == "serve" else "app"
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

    with Engine(Limits(threads=jobs)) as engine:
        for path in files or ():
            on_line(f"{engine.open_file(path).file} {path}")
        yield engine
