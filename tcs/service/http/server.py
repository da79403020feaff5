"""A server for the application: on this machine alone unless there is a token."""

from __future__ import annotations

import ipaddress
import socket
import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import uvicorn

from tcs.errors import OutputError, ServiceError
from tcs.service.http.guard import Access
from tcs.service.http.protocol import BoundedProtocol

_LEAST_TOKEN = 16
"""Fewest characters of a token."""
_GRACE = 2
"""Longest wait for open requests at the end [s]."""
_TURN = 0.002
"""Longest time for which Python lets another thread go on while the one that answers waits [s]; by
default it is more than twice as long. Less would take more of the processor with many clients."""
_KEEP_ALIVE = 20
"""Time after which an idle connection is closed [s]."""


def checked_access(host: str, token: str | None) -> Access:
    """Return who may send requests to a server at an address.

    Args:
        host: Name or address to listen at.
        token: What requests must carry; None for no token.

    Raises:
        ServiceError: If other machines could send requests without a token, or the token is short.

    >>> checked_access("127.0.0.1", None).token is None
    True
    """
    if token is not None and (len(token) < _LEAST_TOKEN or not token.isascii() or " " in token):
        raise ServiceError(
            f"the token must have at least {_LEAST_TOKEN} characters without spaces, e.g. of "
            "`openssl rand -hex 16`."
        )
    if token is None and not _is_loopback(host):
        raise ServiceError(
            f"'{host}' can be reached from other machines. Give a token with --token or in "
            "TCS_TOKEN, or listen at 127.0.0.1."
        )
    return Access(token=token)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class _Listening(uvicorn.Server):
    """A server that says when it listens."""

    def __init__(self, config: uvicorn.Config, on_listening: Callable[[], object] | None) -> None:
        super().__init__(config)
        self._on_listening = on_listening

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and say so."""
        await super().startup(sockets)
        if self._on_listening is not None:
            self._on_listening()


class Server:
    """A server on a port of its own; `run` blocks, a `with` statement runs it in a thread."""

    def __init__(
        self,
        application: Any,
        *,
        host: str,
        port: int,
        on_listening: Callable[[], object] | None = None,
    ) -> None:
        """Listen at a port.

        Args:
            application: The application.
            host: Name or address to listen at.
            port: The port; 0 for a free one.
            on_listening: Called once requests are answered.

        Raises:
            OutputError: If the port cannot be used.
        """
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        # Only with its protocol named, asyncio sends answers at once (TCP_NODELAY).
        self._socket = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise OutputError(
                f"the server cannot listen at {host}, port {port}: {error.strerror or error}. Give "
                "another one with --port."
            ) from None
        shown = f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self._socket.getsockname()[1]}"
        config = uvicorn.Config(
            application, log_level="warning", access_log=False, server_header=False, lifespan="off",
            timeout_graceful_shutdown=_GRACE, timeout_keep_alive=_KEEP_ALIVE, ws="none",
            http=BoundedProtocol,
        )  # fmt: skip
        self._server = _Listening(config, on_listening)
        self._thread: threading.Thread | None = None

    def run(self, duration: float | None = None) -> None:
        """Answer requests for a duration [s], or until interrupted."""
        end = threading.Timer(duration or 0.0, self._stop)
        end.daemon = True
        if duration is not None:
            end.start()
        sys.setswitchinterval(_TURN)
        try:
            self._server.run(sockets=[self._socket])
        finally:
            end.cancel()
            self._socket.close()

    def _stop(self) -> None:
        self._server.should_exit = True

    def __enter__(self) -> Self:
        """Answer requests in a thread."""
        self._thread = threading.Thread(target=self.run, name="tcs-http", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        """Stop answering."""
        self._stop()
        if self._thread is not None:
            self._thread.join()
