"""HTTP/1.1 on a connection, with limits on its bytes and on the time before a complete request."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

MOST_HEAD_BYTES = 64 * 1024
"""Most bytes of a request beside its content: address, headers, sizes of chunks and trailers."""
MOST_PIPELINED = 16
"""Most requests of a connection that wait for the answer to an earlier one."""
MOST_CONNECTIONS = 256
"""Most connections. Where there are more, the one that has waited longest for a request, or for the
rest of one, is closed: connections that send nothing keep nobody out."""
HEAD_SECONDS = 10
"""Longest time from the beginning of a connection to the end of its first request's headers [s]."""


class BoundedProtocol(HttpToolsProtocol):
    """Closes connections whose requests do not end; the parser would keep them in memory."""

    _waits_for_head = True
    _is_incomplete = True
    """Whether the client is to send something before it is answered."""
    _since = 0.0
    """When the connection began to wait for the present request."""
    _other_bytes = 0
    """Bytes of the present request beside its content; sizes of chunks count as much as these."""
    _has_ended = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin a connection, in place of the one that has waited longest if there are too many."""
        super().connection_made(transport)
        self._since = self.loop.time()
        self.timeout_keep_alive_task = self.loop.call_later(
            HEAD_SECONDS, self.timeout_keep_alive_handler
        )
        if len(self.connections) > MOST_CONNECTIONS:
            waiting = [one for one in self.connections if getattr(one, "_is_incomplete", False)]
            min(waiting, key=_beginning, default=self).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End a connection."""
        self._waits_for_head = False
        self._unset_keepalive_if_required()
        super().connection_lost(exc)

    def _unset_keepalive_if_required(self) -> None:
        """Let the time of an idle connection run on until the headers of a request are complete."""
        if not self._waits_for_head:
            super()._unset_keepalive_if_required()

    def data_received(self, data: bytes) -> None:
        """Read a part of a request, or close the connection."""
        self._has_ended = False
        self._other_bytes += len(data)
        super().data_received(data)
        if self._has_ended:
            # The part is of several requests; what is left of the last one is not larger than it.
            self._other_bytes = 0
        elif self._other_bytes > MOST_HEAD_BYTES and not self.transport.is_closing():
            self.send_400_response("The headers are too large.")

    def on_header(self, name: bytes, value: bytes) -> None:
        """Add a header to those of the request; what follows the content is no header."""
        if self._waits_for_head:
            super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Begin a request whose headers have arrived."""
        self._waits_for_head = False
        self._unset_keepalive_if_required()
        super().on_headers_complete()
        if len(self.pipeline) > MOST_PIPELINED and not self.transport.is_closing():
            self.send_400_response("Too many requests before the first is answered.")

    def on_body(self, body: bytes) -> None:
        """Add to the content of a request; the guard limits it."""
        # The size of a chunk has several bytes: the content makes up for as many.
        self._other_bytes -= 2 * len(body)
        super().on_body(body)

    def on_message_complete(self) -> None:
        """End a request; the headers of another one may follow."""
        self._waits_for_head = self._has_ended = True
        self._is_incomplete, self._other_bytes = False, 0
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """End an answer; the connection waits for the next request."""
        self._is_incomplete, self._since = not self.pipeline, self.loop.time()
        super().on_response_complete()


def _beginning(connection: Any) -> float:
    """Return when a connection began to wait."""
    return float(connection._since)
