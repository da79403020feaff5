"""Errors as `application/problem+json` (RFC 9457), with the one line of the exception."""

from __future__ import annotations

import json

from fastapi import Response

from tcs.errors import BusyError, NotFoundError, TcsError
from tcs.service.responses import ProblemDetails

MEDIA_TYPE = "application/problem+json"
REFUSED, ABSENT, BUSY = 422, 404, 503
_RETRY = {"Retry-After": "1"}


def problem(status: int, title: str, detail: str) -> Response:
    """Return an error.

    Args:
        status: Status of the response.
        title: Class of the error.
        detail: What is wrong and what to do next; line breaks become spaces.
    """
    body = ProblemDetails(title=title, status=status, detail=" ".join(detail.splitlines()))
    return Response(
        json.dumps(body.model_dump()),
        status_code=status,
        media_type=MEDIA_TYPE,
        headers=_RETRY if status == BUSY else None,
    )


def problem_of(error: TcsError) -> Response:
    """Return an exception as a response: 404 not held, 503 busy, 422 any other."""
    status = REFUSED
    if isinstance(error, NotFoundError):
        status = ABSENT
    elif isinstance(error, BusyError):
        status = BUSY
    return problem(status, type(error).__name__, str(error))
