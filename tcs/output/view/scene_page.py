"""A page with a scene of Meshcat, on a server that checks who asks.

Meshcat's own socket lets in any page in a browser of this machine. So it listens where no page
finds it, and what is opened instead is this server: the page loads nothing from elsewhere, and
pages of other servers neither see the scene nor move anything in it.
"""

from __future__ import annotations

import logging
import selectors
import socket
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, ClassVar
from urllib.parse import urlsplit

from pydrake.common import GetDrakePath
from pydrake.geometry import Meshcat

from tcs.errors import OutputError

HOST = "127.0.0.1"
_FIRST = 7000
"""Port of a page, where none is given and this one is free."""
_PATIENCE = 10.0
"""Longest wait for Meshcat, and for the rest of a request [s]."""
_POLL = 0.05
"""Interval at which the end of the server is checked [s]."""
_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'{more}; style-src 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src data:; connect-src 'self' ws://{host} data: blob:; "
    "worker-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_AT_ONCE = 65536
"""Most bytes that are passed on at once."""
_LOG = logging.getLogger(__name__)


def part_of_meshcat(name: str) -> bytes:
    """Return a file of Meshcat, as Drake's package has it."""
    try:
        return Path(GetDrakePath(), "geometry", name).read_bytes()
    except OSError as error:
        raise OutputError(f"the viewer's {name} cannot be read: {error.strerror}.") from error


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        # A browser that closes its page in the middle of an answer is no error.
        _LOG.debug("request of %s ended early", client_address)


class SceneHandler(BaseHTTPRequestHandler):
    """Answers the requests of a page with a scene; the values are those of one page."""

    page: ClassVar[bytes]
    scripts: ClassVar[bytes]
    scene: ClassVar[tuple[str, int]]
    """Host and port of the Meshcat."""
    runs_text = True
    """Whether the page runs text as a script, as Meshcat's sliders and buttons do."""
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "tcs", ""
    timeout = _PATIENCE
    # An answer that waits for the acknowledgement of its headers is late.
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer, or refuse, a request for a page or a socket."""
        path = self.path.partition("?")[0]
        if not self.is_own():
            self.reply(HTTPStatus.FORBIDDEN, "text/plain", b"not an address of this page\n")
        elif self.headers.get("Upgrade", "").lower() == "websocket":
            self._open_scene()
        elif path == "/":
            self.reply(HTTPStatus.OK, "text/html; charset=utf-8", self.page)
        elif path == "/meshcat.js":
            self.reply(HTTPStatus.OK, "text/javascript; charset=utf-8", self.scripts)
        elif path == "/favicon.ico":
            self.reply(HTTPStatus.NO_CONTENT, "image/x-icon", b"")
        else:
            self.answer(path)

    def answer(self, path: str) -> None:
        """Answer a request for what only some pages have."""
        self.reply(HTTPStatus.NOT_FOUND, "text/plain", b"there is no such page\n")

    def is_own(self) -> bool:
        """Return whether a request calls this machine by its own name, from its own page."""
        host = self.headers.get("Host", "")
        origin = self.headers.get("Origin")
        port = self.server.server_port  # type: ignore[attr-defined]
        known = host in (f"localhost:{port}", f"{HOST}:{port}")
        # Of what a page embeds or links to, a browser tells the site only.
        site = self.headers.get("Sec-Fetch-Site", "none")
        return known and origin in (None, f"http://{host}") and site in ("none", "same-origin")

    def _open_scene(self) -> None:
        """Connect the page to Meshcat's socket."""
        self.close_connection = True
        host, port = self.scene
        kept = [f"{name}: {value}" for name, value in self.headers.items() if name != "Host"]
        lines = ("GET / HTTP/1.1", f"Host: {host}:{port}", *kept, "", "")
        try:
            with socket.create_connection(self.scene, _PATIENCE) as meshcat:
                meshcat.settimeout(None)
                self.connection.settimeout(None)
                meshcat.sendall("\r\n".join(lines).encode("latin-1"))
                _relay(self.connection, meshcat)
        except OSError:
            _LOG.debug("the connection of the page to Meshcat is closed")

    def reply(self, status: HTTPStatus, type_: str, content: bytes) -> None:
        """Send an answer."""
        more = " 'unsafe-eval'" if self.runs_text else ""
        policy = _POLICY.format(host=self.headers.get("Host", ""), more=more)
        self.send_response(status)
        self.send_header("Content-Security-Policy", policy)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Content-Type", type_)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Keep the terminal for what the command says."""
        _LOG.debug(format, *arguments)


class ScenePage:
    """A page with the scene of a Meshcat, on the loopback address.

    Attributes:
        url: Its address.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        port: int | None = None,
        *,
        page: bytes | None = None,
        handler: type[SceneHandler] = SceneHandler,
        first: int = _FIRST,
    ) -> None:
        """Start the server.

        Args:
            meshcat: The Meshcat.
            port: Port of the page; None for the first of some, or any free one.
            page: The page; None for Meshcat's own.
            handler: Answers the requests.
            first: Port that is tried where none is given.

        Raises:
            OutputError: If the port cannot be used.
        """
        values = {
            "page": part_of_meshcat("meshcat.html") if page is None else page,
            "scripts": part_of_meshcat("meshcat.js"),
            "scene": (str(urlsplit(meshcat.web_url()).hostname), meshcat.port()),
        }
        answers = type("Handler", (handler,), values)
        for at in (port,) if port is not None else (first, 0):
            try:
                self._server = _Server((HOST, at), answers)
                break
            except OSError as error:
                if at != first or port is not None:
                    why = f"the viewer cannot listen at port {port}: {error.strerror}."
                    raise OutputError(f"{why} Give a free one.") from None
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
