"""The operator's page: Drake's Meshcat with keys, bars, camera pictures and XR controllers.

The page is Drake's own, with a style and scripts added. It is served on the loopback address and
loads nothing from elsewhere. Meshcat's socket, which would let in any page in the browser, is
reached through this server, which checks who asks: pages of other servers neither drive the arm nor
see it.
"""

from __future__ import annotations

import html
import json
import logging
import math
import selectors
import socket
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydrake.common import GetDrakePath

from tcs.errors import OutputError
from tcs.output.view.export import VIEWPORT
from tcs.output.view.teleop.controls import (
    MOVES,
    OTHERS,
    TURN_DOWN,
    TURN_UP,
    buttons,
    group_button,
    key_name,
)
from tcs.output.view.teleop.page_link import LinkError, PageLink
from tcs.output.view.teleop.pose_device import INDEX
from tcs.teleop import Arm

_HOST = "127.0.0.1"
_PATIENCE = 10.0
"""Longest wait for Meshcat [s]."""
_POLL = 0.05
"""Interval at which the end of the server is checked [s]."""
_HTML, _TITLE, _END = "<html>", "<title>Drake MeshCat</title>", "</body>"
"""Parts of Drake's page that are replaced."""
_FILES = ("operator_page.css", "operator_desk.js", "operator_page.js")
_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src data:; connect-src 'self' ws://{host} data: blob:; "
    "worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_MOST_BYTES = 4096
"""Most bytes of a message of the page."""
_AT_ONCE = 65536
"""Most bytes that are passed on at once."""
_LOG = logging.getLogger(__name__)
Pictures = Callable[[], Mapping[str, bytes]]


def operator_html(desk: Mapping[str, Any], *, cameras: bool, xr: bool) -> str:
    """Return the operator's page.

    Args:
        desk: What the page shows of the arm and its controls, of `desk_of`.
        cameras: Whether it shows camera pictures.
        xr: Whether an XR controller can move the tool.

    Raises:
        OutputError: If the page of this version of Drake has another form.
    """
    page = _part_of_meshcat("meshcat.html").decode("utf-8")
    if any(page.count(part) != 1 for part in (_END, _HTML, _TITLE)):
        raise OutputError(
            "the page of Meshcat in this version of Drake cannot be extended. Install the version "
            "that requirements.lock names."
        )
    here = files("tcs.output.view.teleop")
    style, *scripts = (here.joinpath(name).read_text(encoding="utf-8") for name in _FILES)
    script = "\n".join(scripts)
    settings = json.dumps({**desk, "cameras": cameras, "xr": INDEX if xr else None})
    # The text of a script ends at the first "</", wherever it stands.
    settings = settings.replace("</", "<\\/")
    page = page.replace(_HTML, '<html lang="en">').replace(
        _TITLE, f"<title>{html.escape(desk['title'])}</title>"
    )
    page = page.replace("<head>", f"<head>{VIEWPORT}", 1)
    return page.replace(
        _END, f"<style>{style}</style><script>const TCS = {settings};\n{script}</script>{_END}"
    )


def desk_of(
    arm: Arm,
    groups: Sequence[Sequence[int]],
    sliders: Mapping[str, tuple[float, float, float, float]],
) -> dict[str, Any]:
    """Return what the operator's page shows of an arm and the controls that move it.

    Args:
        arm: The arm.
        groups: Joints of each joint group, counted from 0.
        sliders: Lowest and highest value, step and initial value of each slider.

    Returns:
        `title`; `keys`, each with `code`, `key`, `name`, `group` and whether it is held (`hold`);
        `joints`, each with `low` and `high` [deg] and whether it has limits (`bounded`); and
        `sliders`, each with `name`, `low`, `high`, `step` and `value`.
    """
    keys = [
        {"code": code, "key": key_name(code), "name": name, "group": group, "hold": hold}
        for name, code, group, hold in _keys(groups)
    ]
    joints = [
        {
            "low": round(math.degrees(low)) if bounded else -180,
            "high": round(math.degrees(high)) if bounded else 180,
            "bounded": bool(bounded),
        }
        for low, high, bounded in zip(arm.lower, arm.upper, arm.bounded, strict=True)
    ]
    numbers = ("low", "high", "step", "value")
    return {
        "title": f"Teleoperation: {arm.robot.title}", "keys": keys, "joints": joints,
        "sliders": [
            {"name": name, **dict(zip(numbers, of, strict=True))} for name, of in sliders.items()
        ],
    }  # fmt: skip


def _keys(groups: Sequence[Sequence[int]]) -> Iterator[tuple[str, str, str, bool]]:
    """Yield name, code, group of keys on the page, and whether the key is held, of each key."""
    for name, (axis, _, code) in MOVES.items():
        yield name, code, "move the tool" if axis < 3 else "rotate the tool", True
    others = dict(OTHERS)
    for number, joints in enumerate(groups):
        name = group_button(number)
        shown = " ".join(str(joint + 1) for joint in joints)
        yield f"joints {shown}", buttons(len(groups))[name], "joint group", False
    for name in (TURN_DOWN, TURN_UP):
        yield name, others.pop(name), "joint group", True
    for name, code in others.items():
        yield name, code, "mode", False


def _part_of_meshcat(name: str) -> bytes:
    """Return a file of Meshcat, as Drake's package has it."""
    try:
        return Path(GetDrakePath(), "geometry", name).read_bytes()
    except OSError as error:
        raise OutputError(f"the viewer's {name} cannot be read: {error.strerror}.") from error


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        # A browser that closes its page in the middle of a picture is no error.
        _LOG.debug("request of %s ended early", client_address)


class OperatorPage:
    """The operator's page on the loopback address.

    Attributes:
        url: Its address.
    """

    def __init__(
        self,
        page: str,
        pictures: Pictures,
        link: PageLink,
        scene: tuple[str, int],
        port: int | None = None,
    ) -> None:
        """Start the server.

        Args:
            page: The page, of `operator_html`.
            pictures: Returns the last picture of each camera as JPEG, by name.
            link: Takes the input and returns what the page shows.
            scene: Host and port of the Meshcat that has the scene.
            port: Its port; None for a free one.

        Raises:
            OutputError: If the port cannot be used.
        """
        try:
            self._server = _Server((_HOST, port or 0), _handler(page, pictures, link, scene))
        except OSError as error:
            raise OutputError(
                f"the operator's page cannot listen at port {port}: {error.strerror}."
            ) from None
        self.url = f"http://localhost:{self._server.server_port}/"
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(_POLL,), daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def _relay(one: socket.socket, other: socket.socket) -> None:
    """Pass on what two sockets send to each other, until one is closed."""
    with selectors.DefaultSelector() as ready:
        ready.register(one, selectors.EVENT_READ, other)
        ready.register(other, selectors.EVENT_READ, one)
        while True:
            for key, _ in ready.select():
                content = key.fileobj.recv(_AT_ONCE)  # type: ignore[union-attr]
                if not content:
                    return
                key.data.sendall(content)


def _handler(
    page: str, pictures: Pictures, link: PageLink, scene: tuple[str, int]
) -> Callable[..., BaseHTTPRequestHandler]:
    """Return the class that answers the requests."""
    script = _part_of_meshcat("meshcat.js")

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        server_version, sys_version = "tcs", ""
        # An answer that waits for the acknowledgement of its headers is late.
        disable_nagle_algorithm = True

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not (length.isdecimal() and int(length) <= _MOST_BYTES):
                self.close_connection = True
                self._reply(HTTPStatus.BAD_REQUEST, "text/plain", b"no such message\n")
                return
            content = self.rfile.read(int(length))
            if not self._is_own() or self.path != "/link":
                self._reply(HTTPStatus.FORBIDDEN, "text/plain", b"not a message of this page\n")
                return
            try:
                reply = link.receive(json.loads(content))
            except (LinkError, ValueError, RecursionError):
                self._reply(HTTPStatus.BAD_REQUEST, "text/plain", b"no such message\n")
                return
            self._reply(HTTPStatus.OK, "application/json", json.dumps(reply).encode())

        def _is_own(self) -> bool:
            """Return whether a request calls this machine by its own name, from its own page."""
            host = self.headers.get("Host", "")
            origin = self.headers.get("Origin")
            port = self.server.server_port  # type: ignore[attr-defined]
            known = host in (f"localhost:{port}", f"{_HOST}:{port}")
            # Of what a page embeds or links to, a browser tells the site only.
            site = self.headers.get("Sec-Fetch-Site", "none")
            own = origin in (None, f"http://{host}") and site in ("none", "same-origin")
            return known and own

        def do_GET(self) -> None:
            if not self._is_own():
                self._reply(HTTPStatus.FORBIDDEN, "text/plain", b"not an address of this page\n")
                return
            if self.headers.get("Upgrade", "").lower() == "websocket":
                self._open_scene()
                return
            path = self.path.partition("?")[0]
            now = pictures() if path.startswith("/camera") else {}
            names = sorted(now)
            if path == "/":
                self._reply(HTTPStatus.OK, "text/html; charset=utf-8", page.encode())
            elif path == "/meshcat.js":
                self._reply(HTTPStatus.OK, "text/javascript; charset=utf-8", script)
            elif path == "/cameras":
                self._reply(HTTPStatus.OK, "application/json", json.dumps(names).encode())
            elif path == "/favicon.ico":
                self._reply(HTTPStatus.NO_CONTENT, "image/x-icon", b"")
            elif path.removeprefix("/camera/") in map(str, range(len(names))):
                picture = now[names[int(path.removeprefix("/camera/"))]]
                self._reply(HTTPStatus.OK, "image/jpeg", picture)
            else:
                self._reply(HTTPStatus.NOT_FOUND, "text/plain", b"there is no such page\n")

        def _open_scene(self) -> None:
            """Connect the page to Meshcat's socket."""
            self.close_connection = True
            kept = [f"{name}: {value}" for name, value in self.headers.items() if name != "Host"]
            lines = ("GET / HTTP/1.1", f"Host: {scene[0]}:{scene[1]}", *kept, "", "")
            try:
                with socket.create_connection(scene, _PATIENCE) as meshcat:
                    meshcat.settimeout(None)
                    meshcat.sendall("\r\n".join(lines).encode("latin-1"))
                    _relay(self.connection, meshcat)
            except OSError:
                _LOG.debug("the connection of the page to Meshcat is closed")

        def _reply(self, status: HTTPStatus, type_: str, content: bytes) -> None:
            host = self.headers.get("Host", "")
            self.send_response(status)
            self.send_header("Content-Security-Policy", _POLICY.format(host=host))
            self.send_header("X-Content-Type-Options", "nosniff")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("Content-Type", type_)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *arguments: Any) -> None:
            # The terminal shows why the arm stops.
            _LOG.debug(format, *arguments)

    return Handler
