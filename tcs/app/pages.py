"""The files of the page, as responses of the service."""

from __future__ import annotations

from importlib.resources import files

from fastapi import FastAPI, Response

from tcs.service.http.description import problem

LANGUAGES = ("en", "de")
"""Languages of the page; the texts of each are in one file."""
_TYPES = {".js": "text/javascript", ".css": "text/css", ".json": "application/json"}
_NAMES = (
    *(
        "api.js",
        "editing.js",
        "main.js",
        "map.js",
        "marks.js",
        "panels.js",
        "playing.js",
        "solids.js",
    ),
    *("texts.js", "things.js", "view3d.js", "style.css"),
    *(f"{language}.json" for language in LANGUAGES),
)
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; connect-src 'self'; "
    "frame-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)


def add_page(application: FastAPI) -> None:
    """Add the page to the application of a service, at `/`."""
    folder = files("tcs.app").joinpath("page")
    contents = {name: folder.joinpath(name).read_bytes() for name in ("index.html", *_NAMES)}

    async def page() -> Response:
        headers = {"Content-Security-Policy": _POLICY}
        return Response(contents["index.html"], media_type="text/html", headers=headers)

    async def part(name: str) -> Response:
        if name not in _NAMES:
            return problem(404, "NotFoundError", "there is no such part of the page.")
        media_type = _TYPES[f".{name.rpartition('.')[2]}"]
        return Response(contents[name], media_type=media_type)

    application.add_api_route("/", page, include_in_schema=False)
    application.add_api_route("/app/{name}", part, include_in_schema=False)
