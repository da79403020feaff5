"""Who may send requests, how much and how long: checked before they reach the engine."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections import deque
from collections.abc import Awaitable, Callable, MutableMapping, Sequence
from dataclasses import dataclass
from typing import Any

from tcs.service.http.description import BUSY, problem
from tcs.service.limits import Limits

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

_HEADERS = (
    (b"cache-control", b"no-store"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"SAMEORIGIN"),
)
_POLICY = (b"content-security-policy", b"default-src 'none'; frame-ancestors 'none'; sandbox")
"""Of a response that states none: nothing in it is run, wherever its texts come from."""
_PART = 1024**2
"""Least bytes of the parts of a content, but for the last one."""
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Who may send requests."""

    token: str | None = None
    """What requests must carry as `Authorization: Bearer TOKEN`; None for no token."""
    names: frozenset[str] = frozenset({"127.0.0.1", "localhost", "[::1]", "::1"})
    """Without a token: the names by which this machine may be called in a browser's address. A page
    from elsewhere that resolves its own name to this machine is refused."""


class _RefusedError(Exception):
    """A request whose content is not accepted: the response, or None where nobody waits for it."""

    def __init__(self, response: Any = None) -> None:
        super().__init__()
        self.response = response


class Guard:
    """Refuses requests that are not allowed, too large or too slow, or too many at once."""

    def __init__(self, application: Application, access: Access, limits: Limits) -> None:
        """Guard an application."""
        self._application, self._access, self._limits = application, access, limits
        self._at_once = 0
        self._bytes = 0
        """Bytes of the content of all requests that arrive or are answered."""

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it on."""
        if scope["type"] != "http":
            await self._application(scope, receive, send)
            return
        size = 0

        def counted(more: int) -> int:
            nonlocal size
            size += more
            self._bytes += more
            return size

        try:
            refusal = self._refusal(scope)
            if refusal is not None:
                raise _RefusedError(refusal)
            content = await self._content(scope, receive, counted)
            # A request that has not arrived takes no place from those that have.
            if self._at_once >= self._limits.requests_at_once:
                text = f"{self._at_once} requests are being answered, the most at once. Try again."
                raise _RefusedError(problem(BUSY, "BusyError", text))
            self._at_once += 1
            try:
                await self._answer(scope, _again(content, receive), send)
            finally:
                self._at_once -= 1
        except _RefusedError as refused:
            if refused.response is not None:
                # What else the client may send is not read.
                refused.response.headers["connection"] = "close"
                await refused.response(scope, receive, send)
        finally:
            self._bytes -= size

    async def _content(
        self, scope: Message, receive: Receive, counted: Callable[[int], int]
    ) -> list[bytes]:
        """Return the content of a request, in parts: copying all of it would take milliseconds.

        Args:
            scope: The request.
            receive: Returns the next part.
            counted: Adds a number of bytes to those of the request, and returns the sum.

        Raises:
            _RefusedError: If it is too large or too slow, or the client is gone.
        """
        limits = self._limits
        most = limits.file_bytes if scope["path"] == "/v1/files" else limits.request_bytes
        parts: list[bytes] = []
        part = bytearray()
        try:
            async with asyncio.timeout(limits.request_seconds):
                while True:
                    message = await receive()
                    if message["type"] != "http.request":
                        raise _RefusedError
                    part += message.get("body", b"")
                    size = counted(len(message.get("body", b"")))
                    if size > most:
                        text = f"the request has more than {most:,} bytes, the limit."
                        raise _RefusedError(problem(413, "TooLarge", text))
                    # Large contents that fill the memory keep no small one out.
                    if size > limits.request_bytes and self._bytes > limits.content_bytes:
                        text = "the contents of all requests fill the memory for them. Try again."
                        raise _RefusedError(problem(BUSY, "BusyError", text))
                    is_last = not message.get("more_body", False)
                    if is_last or len(part) >= _PART:
                        parts.append(bytes(part))
                        part.clear()
                    if is_last:
                        return parts
        except TimeoutError:
            text = f"the content of the request took longer than {limits.request_seconds:g} s."
            raise _RefusedError(problem(408, "TooSlow", text)) from None

    async def _answer(self, scope: Message, receive: Receive, send: Send) -> None:
        begun = False

        async def send_guarded(message: Message) -> None:
            nonlocal begun
            if message["type"] == "http.response.start":
                begun = True
                headers = [*message.get("headers", ()), *_HEADERS]
                if all(name.lower() != _POLICY[0] for name, _ in headers):
                    headers.append(_POLICY)
                message["headers"] = headers
            await send(message)

        try:
            await self._application(scope, receive, send_guarded)
        except Exception:
            _LOG.exception("%s %s failed", scope["method"], scope["path"])
            if begun:
                raise
            text = "a defect of the program; see the server's log."
            await problem(500, "InternalError", text)(scope, receive, send)

    def _refusal(self, scope: Message) -> Any:
        """Return the response to a request that is not allowed, or None."""
        headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
        host = headers.get(b"host", "")
        if self._access.token is None and _name_of(host) not in self._access.names:
            text = "this server answers requests to this machine's own address only."
            return problem(403, "Forbidden", text)
        origin = headers.get(b"origin")
        if _is_from_elsewhere(scope["path"], headers) or (
            origin is not None and origin.partition("://")[2] != host
        ):
            return problem(403, "Forbidden", "this server does not answer pages of other servers.")
        if self._access.token is not None and not self._has_token(headers):
            text = "the request lacks the token: Authorization: Bearer TOKEN."
            return problem(401, "Unauthorized", text)
        return None

    def _has_token(self, headers: dict[bytes, str]) -> bool:
        scheme, _, given = headers.get(b"authorization", "").partition(" ")
        expected = (self._access.token or "").encode()
        return scheme.lower() == "bearer" and secrets.compare_digest(
            given.strip().encode("utf-8", "replace"), expected
        )


def _is_from_elsewhere(path: str, headers: dict[bytes, str]) -> bool:
    """Return whether a page of another server asks, as the browser says.

    It names no origin where such a page embeds this one, or links to it. A link to the page at `/`
    is followed: a shared one may stand anywhere, and the page asks for the rest by itself.
    """
    is_link = path == "/" and headers.get(b"sec-fetch-dest") == "document"
    return headers.get(b"sec-fetch-site") in ("cross-site", "same-site") and not is_link


def _name_of(host: str) -> str:
    """Return the name or address of a Host header, without its port."""
    name, colon, port = host.rpartition(":")
    return (name if colon and port.isdecimal() else host).lower()


def _again(parts: Sequence[bytes], receive: Receive) -> Receive:
    """Return a function that returns the parts of the content of a request, and then the rest."""
    left = deque(parts)

    async def received() -> Message:
        if left:
            return {"type": "http.request", "body": left.popleft(), "more_body": bool(left)}
        # Only the end of the connection may follow, at any time.
        return await receive()

    return received
