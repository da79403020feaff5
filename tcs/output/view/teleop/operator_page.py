"""The operator's page: Drake's Meshcat with keys, bars, camera pictures and XR controllers.

The page is Drake's own, with a style and scripts added. It is served on the loopback address and
loads nothing from elsewhere: Meshcat's script and its socket are those of this machine. Pages of
other servers cannot drive the arm.
"""

from __future__ import annotations

import html
import json
import logging
import math
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

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
"""Longest wait for the page of Meshcat [s]."""
_POLL = 0.05
"""Interval at which the end of the server is checked [s]."""
_SCRIPT, _ADDRESS, _END = 'type="text/javascript" src="', "url = location.toString();", "</body>"
_HTML, _TITLE = "<html>", "<title>Drake MeshCat</title>"
"""Parts of Drake's page that are replaced."""
_FILES = ("operator_page.css", "operator_desk.js", "operator_page.js")
_MOST_BYTES = 4096
"""Most bytes of a message of the page."""
_LOG = logging.getLogger(__name__)
Pictures = Callable[[], Mapping[str, bytes]]


def operator_html(meshcat_port: int, desk: Mapping[str, Any], *, cameras: bool, xr: bool) -> str:
    """Return the operator's page.

    Args:
        meshcat_port: Port of the Meshcat, on this machine.
        desk: What the page shows of the arm and its keys, of `desk_of`.
        cameras: Whether it shows camera pictures.
        xr: Whether an XR controller can move the tool.

    Raises:
        OutputError: If the page of this version of Drake has another form.
    """
    page = _page_of_meshcat(meshcat_port)
    if any(page.count(part) != 1 for part in (_SCRIPT, _ADDRESS, _END, _HTML, _TITLE)):
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
    url = f"http://localhost:{meshcat_port}/"
    page = page.replace(_SCRIPT, _SCRIPT + url)
    page = page.replace(_ADDRESS, f"url = {json.dumps(url)};")
    page = page.replace("<head>", f"<head>{VIEWPORT}", 1)
    return page.replace(
        _END, f"<style>{style}</style><script>const TCS = {settings};\n{script}</script>{_END}"
    )


def desk_of(arm: Arm, groups: Sequence[Sequence[int]]) -> dict[str, Any]:
    """Return what the operator's page shows of an arm and the keys that move it.

    Args:
        arm: The arm.
        groups: Joints of each joint group, counted from 0.

    Returns:
        `title`; `keys`, each with `code`, `key`, `name`, `group` and whether it is held (`hold`);
        and `joints`, each with `low` and `high` [deg] and whether it has limits (`bounded`).
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
    return {"title": f"Teleoperation: {arm.robot.title}", "keys": keys, "joints": joints}


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


def _page_of_meshcat(port: int) -> str:
    """Return the page that a Meshcat serves; its script has another name in each version."""
    connection = HTTPConnection("localhost", port, timeout=_PATIENCE)
    try:
        connection.request("GET", "/")
        return connection.getresponse().read().decode("utf-8")
    except (OSError, HTTPException) as error:
        raise OutputError(f"the viewer at port {port} does not answer: {error}.") from error
    finally:
        connection.close()


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
        self, page: str, pictures: Pictures, link: PageLink, port: int | None = None
    ) -> None:
        """Start the server.

        Args:
            page: The page, of `operator_html`.
            pictures: Returns the last picture of each camera as JPEG, by name.
            link: Takes the keys and returns what the page shows.
            port: Its port; None for a free one.

        Raises:
            OutputError: If the port cannot be used.
        """
        try:
            self._server = _Server((_HOST, port or 0), _handler(page, pictures, link))
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


def _handler(
    page: str, pictures: Pictures, link: PageLink
) -> Callable[..., BaseHTTPRequestHandler]:
    """Return the class that answers the requests."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        server_version, sys_version = "tcs", ""

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
            known = host.rpartition(":")[0] in ("localhost", _HOST)
            return known and origin in (None, f"http://{host}")

        def do_GET(self) -> None:
            if not self._is_own():
                self._reply(HTTPStatus.FORBIDDEN, "text/plain", b"not an address of this page\n")
                return
            path = self.path.partition("?")[0]
            now = pictures() if path.startswith("/camera") else {}
            names = sorted(now)
            if path == "/":
                self._reply(HTTPStatus.OK, "text/html; charset=utf-8", page.encode())
            elif path == "/cameras":
                self._reply(HTTPStatus.OK, "application/json", json.dumps(names).encode())
            elif path == "/favicon.ico":
                self._reply(HTTPStatus.NO_CONTENT, "image/x-icon", b"")
            elif path.removeprefix("/camera/") in map(str, range(len(names))):
                picture = now[names[int(path.removeprefix("/camera/"))]]
                self._reply(HTTPStatus.OK, "image/jpeg", picture)
            else:
                self._reply(HTTPStatus.NOT_FOUND, "text/plain", b"there is no such page\n")

        def _reply(self, status: HTTPStatus, type_: str, content: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", type_)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *arguments: Any) -> None:
            # The terminal shows why the arm stops.
            _LOG.debug(format, *arguments)

    return Handler
