"""The OpenAPI description of the service, a page that shows it offline, and its errors."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from fastapi import Response
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from tcs.errors import BusyError, NotFoundError, TcsError
from tcs.service.operations import OPERATIONS
from tcs.service.responses import FileEntry, JobStatus, ProblemDetails

_REFERENCE = "#/components/schemas/{model}"
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;margin:0 auto;max-width:60rem;padding:1rem;"
    "color:#1a1a1a;background:#fff}code,pre{font-family:ui-monospace,monospace;font-size:.9em}"
    "pre{background:#f3f3f3;padding:.75rem;overflow-x:auto}table{border-collapse:collapse}"
    "td,th{border-bottom:1px solid #ccc;padding:.25rem .75rem .25rem 0;text-align:left;"
    "vertical-align:top}h2{margin-top:2rem}"
)


def schemas() -> dict[str, Any]:
    """Return the schemas of all requests and responses, by the names of their models."""
    models: list[type[BaseModel]] = [*(one.request for one in OPERATIONS)]
    models += [FileEntry, JobStatus, ProblemDetails]
    _, found = models_json_schema([(one, "validation") for one in models], ref_template=_REFERENCE)
    return dict(found["$defs"])


def body_of(name: str) -> dict[str, Any]:
    """Return the description of a body of JSON, by the name of its model."""
    return {"required": True, "content": {"application/json": {"schema": reference(name)}}}


def reference(name: str) -> dict[str, str]:
    """Return the reference to a schema."""
    return {"$ref": _REFERENCE.format(model=name)}


def problem_response(text: str) -> dict[str, Any]:
    """Return the description of an error."""
    return {"description": text, "content": {MEDIA_TYPE: {"schema": reference("ProblemDetails")}}}


def page(description: Mapping[str, Any]) -> str:
    """Return a page with every request, its fields and an example.

    Args:
        description: The OpenAPI description.
    """
    parts = "\n".join(
        _operation(path, verb, one, description["components"]["schemas"])
        for path, verbs in description["paths"].items()
        for verb, one in verbs.items()
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,">\n<title>tcs service</title>\n<style>{_STYLE}</style>\n'
        f"</head>\n<body>\n<main>\n<h1>{escape(description['info']['title'])}</h1>\n"
        f"<p>{escape(description['info']['description'])}</p>\n"
        '<p>The same for programs: <a href="openapi.json">openapi.json</a>.</p>\n'
        f"{parts}\n</main>\n</body>\n</html>\n"
    )


def _operation(path: str, verb: str, one: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    """Return the section of one request."""
    text = f"<h2><code>{verb.upper()} {escape(path)}</code></h2>\n<p>{escape(one['summary'])}</p>"
    content = one.get("requestBody", {}).get("content", {})
    if "application/json" not in content:
        return text
    name = content["application/json"]["schema"]["$ref"].rpartition("/")[2]
    rows = "".join(_rows(known[name]))
    example = json.dumps({key: "..." for key in known[name].get("required", ())})
    return (
        f"{text}\n<table><tr><th>field</th><th>form</th><th>default</th></tr>{rows}</table>\n"
        f"<pre>curl -H 'Content-Type: application/json' -d '{escape(example)}' "
        f"http://127.0.0.1:8000{escape(path)}</pre>"
    )


def _rows(schema: Mapping[str, Any]) -> Iterator[str]:
    """Yield the row of each field of a schema."""
    required = set(schema.get("required", ()))
    for name, one in schema["properties"].items():
        default = "required" if name in required else json.dumps(one.get("default", None))
        yield (
            f"<tr><td><code>{escape(name)}</code></td><td>{escape(_form(one))}</td>"
            f"<td>{escape(default)}</td></tr>"
        )


def _form(schema: Mapping[str, Any]) -> str:
    """Return the form of a value in a few words."""
    if "anyOf" in schema:
        return " or ".join(_form(one) for one in schema["anyOf"])
    if "prefixItems" in schema:
        return f"[{', '.join(_form(one) for one in schema['prefixItems'])}]"
    if schema.get("type") == "array":
        return f"list of {_form(schema.get('items', {}))}"
    if schema.get("type") == "object":
        return f"mapping of names to {_form(schema.get('additionalProperties', {}))}"
    return str(schema.get("description") or schema.get("type", "any"))


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
