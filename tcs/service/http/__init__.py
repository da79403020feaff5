"""The engine over HTTP: JSON, an OpenAPI description, server-sent events; requires `tcs[service]`.

In: an engine and who may send requests. Out: an application for any ASGI server, and a server for
it. The methods of `tcs.service.client.Client` are the requests that it answers.
"""

from __future__ import annotations

from tcs.service.http.application import make_application
from tcs.service.http.guard import Access
from tcs.service.http.server import Server, checked_access

__all__ = ["Access", "Server", "checked_access", "make_application"]
