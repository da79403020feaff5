"""The operator's page: Drake's Meshcat with camera pictures and XR controllers.

The page is Drake's own, with a style and a script added. It is served on the loopback address and
loads nothing from elsewhere: Meshcat's script and its socket are those of this machine.
"""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from tcs.errors import OutputError
from tcs.output.view.teleop.pose_device import INDEX

_HOST = "127.0.0.1"
_PATIENCE = 10.0
"""Longest wait for the page of Meshcat [s]."""
_POLL = 0.05
"""Interval at which the end of the server is checked [s]."""
_SCRIPT, _ADDRESS, _END = 'type="text/javascript" src="', "url = location.toString();", "</body>"
"""Parts of Drake's page that are replaced."""
_VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
"""Pixels of a phone are those of its screen."""
_LOG = logging.getLogger(__name__)
Pictures = Callable[[], Mapping[str, bytes]]


def operator_html(meshcat_port: int, *, cameras: bool, xr: bool) -> str:
    """Return the operator's page.

    Args:
        meshcat_port: Port of the Meshcat, on this machine.
        cameras: Whether it shows camera pictures.
        xr: Whether an XR controller can move the tool.

    Raises:
        OutputError: If the page of this version of Drake has another form.
    """
    page = _page_of_meshcat(meshcat_port)
    if any(page.count(part) != 1 for part in (_SCRIPT, _ADDRESS, _END)):
        raise OutputError(
            "the page of Meshcat in this version of Drake cannot be extended. Drive without "
            "--cameras and --xr."
        )
    here = files("tcs.output.view.teleop")
    style, script = (
        here.joinpath(name).read_text(encoding="utf-8")
        for name in ("operator_page.css", "operator_page.js")
    )
    settings = json.dumps({"cameras": cameras, "xr": INDEX if xr else None})
    url = f"http://localhost:{meshcat_port}/"
    page = page.replace(_SCRIPT, _SCRIPT + url)
    page = page.replace(_ADDRESS, f"url = {json.dumps(url)};")
    page = page.replace("<head>", f"<head>{_VIEWPORT}", 1)
    return page.replace(
        _END, f"<style>{style}</style><script>const TCS = {settings};\n{script}</script>{_END}"
    )


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

    def __init__(self, page: str, pictures: Pictures, port: int | None = None) -> None:
        """Start the server.

        Args:
            page: The page, of `operator_html`.
            pictures: Returns the last picture of each camera as JPEG, by name.
            port: Its port; None for a free one.

        Raises:
            OutputError: If the port cannot be used.
        """
        try:
            self._server = _Server((_HOST, port or 0), _handler(page, pictures))
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


def _handler(page: str, pictures: Pictures) -> Callable[..., BaseHTTPRequestHandler]:
    """Return the class that answers the requests."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"
        server_version, sys_version = "tcs", ""

        def do_GET(self) -> None:
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
