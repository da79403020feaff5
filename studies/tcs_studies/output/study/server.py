"""Server of a participant's forms, on the loopback address, with the standard library.

The address contains a random token, so that no other page in the browser can send answers. Answers
are checked here once more, whatever the browser has checked, and recorded before the reply.
"""

from __future__ import annotations

import logging
import secrets
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs

from tcs.errors import OutputError, TcsError
from tcs_studies.output.study.page import Filled, field_name, form_page, text_page
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.steps import Step, steps_of

_HOST = "127.0.0.1"
_MOST_BYTES = 256 * 1024
"""Most bytes of a request: a form with all its texts has a tenth."""
_MOST_FIELDS = 100
_TIMEOUT = 30.0
"""Longest wait for the rest of a request [s]."""
_REFRESH = 2
"""Interval at which the page of a trial is loaded again [s]."""
_POLL = 0.05
"""Interval at which the end of a form, and of the server, is checked [s]."""
_FOLLOWS = 2.0
"""Longest time that a browser takes to follow a redirection [s]."""
_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
_LOG = logging.getLogger(__name__)


class FormServer:
    """Pages of a participant's session: the form that is due, or what comes next.

    Attributes:
        url: Address of the page.
    """

    def __init__(self, recording: StudyRecording, *, port: int | None, refresh: bool) -> None:
        """Start the server.

        Args:
            recording: The session.
            port: Its port; None for a free one.
            refresh: Whether the page of a trial loads again until a form is due.

        Raises:
            OutputError: If the port cannot be used.
        """
        self._recording, self._refresh = recording, refresh
        self._path = f"/{secrets.token_urlsafe(16)}/"
        try:
            self._server = ThreadingHTTPServer((_HOST, port or 0), _handler(self))
        except OSError as error:
            raise OutputError(
                f"the questionnaire cannot listen at port {port}: {error.strerror}. Give a free "
                "one with --port."
            ) from None
        self._server.daemon_threads = True
        self.url = f"http://{_HOST}:{self._server.server_port}{self._path}"
        self._is_redirected = False
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(_POLL,), daemon=True
        )
        self._thread.start()

    def finish(self) -> None:
        """Wait until the browser has followed the redirection from the last form, at most 2 s."""
        last = time.monotonic() + _FOLLOWS
        while self._is_redirected and time.monotonic() < last:
            time.sleep(_POLL)

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def wait(self, step: Step, duration: float | None = None) -> bool:
        """Wait until the form of a step is recorded; return whether it is.

        Args:
            step: The step.
            duration: Longest wait [s]; None to wait until interrupted.
        """
        end = None if duration is None else time.monotonic() + duration
        while step.key not in self._recording.participant.steps:
            if end is not None and time.monotonic() >= end:
                return False
            time.sleep(_POLL)
        return True

    def is_address(self, host: str | None, path: str) -> bool:
        """Return whether a request names this server and its token."""
        port = self._server.server_port
        return path == self._path and host in (f"{_HOST}:{port}", f"localhost:{port}")

    def page(self) -> str:
        """Return the page of the next step."""
        step, self._is_redirected = self._recording.next_step, False
        if step is not None and step.form is not None:
            return self._form_page(step)
        if step is None:
            return text_page(
                "Thank you", "All answers are saved. You can close this page.",
                heading=self._heading(),
            )  # fmt: skip
        return text_page(
            "Saved",
            f"Next: {self._recording.text(step)}. Leave this page open; the next questionnaire "
            "appears here."
            if self._refresh
            else f"Next: {self._recording.text(step)}. You can close this page.",
            heading=self._heading(),
            refresh=_REFRESH if self._refresh else None,
        )

    def answered(self, fields: dict[str, list[str]]) -> tuple[HTTPStatus, str]:
        """Record the fields of a form.

        Args:
            fields: Values by field, as the browser sent them.

        Returns:
            SEE_OTHER and nothing if they were recorded, or were before; otherwise a status and the
            page to show.
        """
        recording = self._recording
        steps = {one.key: one for one in steps_of(recording.study, recording.participant.order)}
        step = steps.get(fields.get("step", [""])[0])
        if step is None or step.form is None:
            text = "The form does not belong to this session. Open the address again."
            return HTTPStatus.BAD_REQUEST, text_page("Not saved", text)
        filled = self._filled(step, fields)
        record = recording.participant.steps.get(step.key)
        if record is not None:
            return self._again(step, filled, record.answers)
        if filled.faults:
            return HTTPStatus.UNPROCESSABLE_ENTITY, self._form_page(step, filled)
        try:
            recording.save_answers(step, filled.values)
        except TcsError as error:
            _LOG.warning("%s", error)
            failed = Filled(values=filled.values, faults={}, message=str(error))
            return HTTPStatus.INTERNAL_SERVER_ERROR, self._form_page(step, failed)
        self._is_redirected = True
        return HTTPStatus.SEE_OTHER, ""

    def _again(self, step: Step, filled: Filled, answers: Any) -> tuple[HTTPStatus, str]:
        """Return the reply to a form that has a record: the first answers stay."""
        form = self._recording.form(step)
        if filled.faults or form.checked(filled.values, step.key) != answers:
            text = (
                "This questionnaire was saved before, and the first answers are kept. Inform "
                "the experimenter if they need a correction. Open the address again to continue."
            )
            return HTTPStatus.CONFLICT, text_page("Already saved", text, heading=self._heading())
        return HTTPStatus.SEE_OTHER, ""

    def _filled(self, step: Step, fields: dict[str, list[str]]) -> Filled:
        """Return the content of the fields by question, and what is wrong with it."""
        form = self._recording.form(step)
        names = {field_name(i): one.key for i, one in enumerate(form.questions)}
        values = {names.get(name, name): texts[-1] for name, texts in fields.items()}
        values.pop("step", None)
        twice = {
            names.get(name, name): "is answered twice"
            for name, texts in fields.items()
            if len(texts) > 1
        }
        return Filled(values=values, faults={**form.faults(values), **twice})

    def _form_page(self, step: Step, filled: Filled | None = None) -> str:
        form = self._recording.form(step)
        heading, key = self._heading(), step.key
        if filled is None:
            return form_page(form, step=key, heading=heading)
        return form_page(form, step=key, heading=heading, filled=filled)

    def _heading(self) -> str:
        done, total = self._recording.progress()
        title = self._recording.study.plan.title
        return f"{title} · {self._recording.participant.participant} · {done} of {total} steps done"


def _handler(server: FormServer) -> Callable[..., BaseHTTPRequestHandler]:
    """Return the class that answers the requests to a server."""

    class Handler(BaseHTTPRequestHandler):
        timeout = _TIMEOUT
        server_version, sys_version = "tcs", ""

        def do_GET(self) -> None:
            if self._is_ours():
                self._reply(HTTPStatus.OK, server.page())

        def do_POST(self) -> None:
            if not self._is_ours():
                return
            fields = self._fields()
            if fields is None:
                text = "The form could not be read. Open the address again."
                self._reply(HTTPStatus.BAD_REQUEST, text_page("Not saved", text))
                return
            status, page = server.answered(fields)
            self._reply(status, page)

        def _is_ours(self) -> bool:
            if server.is_address(self.headers.get("Host"), self.path):
                return True
            text = "There is no page at this address. Use the one that the terminal shows."
            self._reply(HTTPStatus.NOT_FOUND, text_page("Not found", text))
            return False

        def _fields(self) -> dict[str, list[str]] | None:
            """Return the fields of a form; None if the request is not one."""
            length = self.headers.get("Content-Length", "")
            type_ = self.headers.get("Content-Type", "").partition(";")[0].strip()
            if not length.isdecimal() or len(length) > 9 or int(length) > _MOST_BYTES:
                self.close_connection = True
                return None
            try:
                content = self.rfile.read(int(length))
                if type_ != "application/x-www-form-urlencoded" or len(content) < int(length):
                    return None
                return parse_qs(
                    content.decode("ascii"),
                    keep_blank_values=True,
                    errors="strict",
                    max_num_fields=_MOST_FIELDS,
                )
            except (OSError, ValueError):
                self.close_connection = True
                return None

        def _reply(self, status: HTTPStatus, page: str) -> None:
            content = page.encode()
            self.send_response(status)
            if status is HTTPStatus.SEE_OTHER:
                self.send_header("Location", self.path)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Content-Security-Policy", _POLICY)
            self.send_header("Cache-Control", "no-store")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *arguments: Any) -> None:
            # The terminal belongs to the experimenter.
            _LOG.debug(format, *arguments)

    return Handler
