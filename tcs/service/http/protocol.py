"""HTTP/1.1 on a connection, with a limit on what comes before the content of a request."""

from __future__ import annotations

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

MOST_HEAD_BYTES = 64 * 1024
"""Most bytes of the address and the headers of a request."""


class BoundedProtocol(HttpToolsProtocol):
    """Refuses requests whose address and headers do not end: the parser keeps them in memory."""

    _waits_for_head = True
    _head_bytes = 0
    _has_ended = False

    def data_received(self, data: bytes) -> None:
        """Read a part of a request, or close the connection."""
        self._has_ended = False
        super().data_received(data)
        # After the end of a request, the part is mostly its content.
        if not self._waits_for_head or self._has_ended:
            return
        self._head_bytes += len(data)
        if self._head_bytes > MOST_HEAD_BYTES and not self.transport.is_closing():
            self.send_400_response("The headers are too large.")

    def on_headers_complete(self) -> None:
        """Begin a request whose headers have arrived."""
        self._waits_for_head, self._head_bytes = False, 0
        super().on_headers_complete()

    def on_message_complete(self) -> None:
        """End a request; the headers of another one may follow."""
        self._waits_for_head = self._has_ended = True
        super().on_message_complete()
