"""The operator's page: Drake's Meshcat with keys, bars, camera pictures and XR controllers.

The page is Drake's own, with a style and scripts added. Its server checks who asks
(`tcs.output.view.scene_page`): pages of other servers neither drive the arm nor see it.
"""

from __future__ import annotations

import html
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from http import HTTPStatus
from importlib.resources import files
from typing import Any

from pydrake.geometry import Meshcat

from tcs.errors import OutputError
from tcs.output.view.export import VIEWPORT
from tcs.output.view.scene_page import SceneHandler, ScenePage, part_of_meshcat
from tcs.output.view.teleop.controls import (
    MOVES,
    OTHERS,
    TURN_DOWN,
    TURN_UP,
    buttons,
    group_button,
    key_name,
)
from tcs.output.view.teleop.page_link import LinkError, PageLink
from tcs.output.view.teleop.pose_device import INDEX
from tcs.teleop import Arm

_HTML, _TITLE, _END = "<html>", "<title>Drake MeshCat</title>", "</body>"
"""Parts of Drake's page that are replaced."""
_FILES = ("operator_page.css", "operator_desk.js", "operator_page.js")
_MOST_BYTES = 4096
"""Most bytes of a message of the page."""
_PORT = 7100
"""Port of the page, where none is given and this one is free."""
Pictures = Callable[[], Mapping[str, bytes]]


def operator_html(desk: Mapping[str, Any], *, cameras: bool, xr: bool) -> str:
    """Return the operator's page.

    Args:
        desk: What the page shows of the arm and its controls, of `desk_of`.
        cameras: Whether it shows camera pictures.
        xr: Whether an XR controller can move the tool.

    Raises:
        OutputError: If the page of this version of Drake has another form.
    """
    page = part_of_meshcat("meshcat.html").decode("utf-8")
    if any(page.count(part) != 1 for part in (_END, _HTML, _TITLE)):
        raise OutputError(
            "the page of Meshcat in this version of Drake cannot be extended. Install the version "
            "that requirements.lock names."
        )
    here = files("tcs.output.view.teleop")
    style, *scripts = (here.joinpath(name).read_text(encoding="utf-8") for name in _FILES)
    script = "\n".join(scripts)
    settings = json.dumps({**desk, "cameras": cameras, "xr": INDEX if xr else None})
    # The text of a script ends at the first "</", wherever it stands.
    settings = settings.replace("</", "<\\/")
    page = page.replace(_HTML, '<html lang="en">').replace(
        _TITLE, f"<title>{html.escape(desk['title'])}</title>"
    )
    page = page.replace("<head>", f"<head>{VIEWPORT}", 1)
    return page.replace(
        _END, f"<style>{style}</style><script>const TCS = {settings};\n{script}</script>{_END}"
    )


def desk_of(
    arm: Arm,
    groups: Sequence[Sequence[int]],
    sliders: Mapping[str, tuple[float, float, float, float]],
) -> dict[str, Any]:
    """Return what the operator's page shows of an arm and the controls that move it.

    Args:
        arm: The arm.
        groups: Joints of each joint group, counted from 0.
        sliders: Lowest and highest value, step and initial value of each slider.

    Returns:
        `title`; `keys`, each with `code`, `key`, `name`, `group` and whether it is held (`hold`);
        `joints`, each with `low` and `high` [deg] and whether it has limits (`bounded`); and
        `sliders`, each with `name`, `low`, `high`, `step` and `value`.
    """
    keys = [
        {"code": code, "key": key_name(code), "name": name, "group": group, "hold": hold}
        for name, code, group, hold in _keys(groups)
    ]
    joints = [
        {
            "low": round(math.degrees(low)) if bounded else -180,
            "high": round(math.degrees(high)) if bounded else 180,
            "bounded": bool(bounded),
        }
        for low, high, bounded in zip(arm.lower, arm.upper, arm.bounded, strict=True)
    ]
    numbers = ("low", "high", "step", "value")
    return {
        "title": f"Teleoperation: {arm.robot.title}", "keys": keys, "joints": joints,
        "sliders": [
            {"name": name, **dict(zip(numbers, of, strict=True))} for name, of in sliders.items()
        ],
    }  # fmt: skip


def _keys(groups: Sequence[Sequence[int]]) -> Iterator[tuple[str, str, str, bool]]:
    """Yield name, code, group of keys on the page, and whether the key is held, of each key."""
    for name, (axis, _, code) in MOVES.items():
        yield name, code, "move the tool" if axis < 3 else "rotate the tool", True
    others = dict(OTHERS)
    for number, joints in enumerate(groups):
        name = group_button(number)
        shown = " ".join(str(joint + 1) for joint in joints)
        yield f"joints {shown}", buttons(len(groups))[name], "joint group", False
    for name in (TURN_DOWN, TURN_UP):
        yield name, others.pop(name), "joint group", True
    for name, code in others.items():
        yield name, code, "mode", False


class OperatorPage(ScenePage):
    """The operator's page on the loopback address."""

    def __init__(
        self,
        page: str,
        pictures: Pictures,
        link: PageLink,
        meshcat: Meshcat,
        port: int | None = None,
    ) -> None:
        """Start the server.

        Args:
            page: The page, of `operator_html`.
            pictures: Returns the last picture of each camera as JPEG, by name.
            link: Takes the input and returns what the page shows.
            meshcat: The Meshcat that has the scene.
            port: Its port; None for 7100 or a free one.

        Raises:
            OutputError: If the port cannot be used.
        """
        handler = _handler(pictures, link)
        super().__init__(meshcat, port, page=page.encode(), handler=handler, first=_PORT)


def _handler(pictures: Pictures, link: PageLink) -> type[SceneHandler]:
    """Return the class that answers the requests."""

    class Handler(SceneHandler):
        runs_text = False

        def do_POST(self) -> None:
            length = self.headers.get("Content-Length", "")
            if not (length.isdecimal() and int(length) <= _MOST_BYTES):
                self.close_connection = True
                self.reply(HTTPStatus.BAD_REQUEST, "text/plain", b"no such message\n")
                return
            content = self.rfile.read(int(length))
            if not self.is_own() or self.path != "/link":
                self.reply(HTTPStatus.FORBIDDEN, "text/plain", b"not a message of this page\n")
                return
            try:
                reply = link.receive(json.loads(content))
            except (LinkError, ValueError, RecursionError):
                self.reply(HTTPStatus.BAD_REQUEST, "text/plain", b"no such message\n")
                return
            self.reply(HTTPStatus.OK, "application/json", json.dumps(reply).encode())

        def answer(self, path: str) -> None:
            now = pictures() if path.startswith("/camera") else {}
            names = sorted(now)
            if path == "/cameras":
                self.reply(HTTPStatus.OK, "application/json", json.dumps(names).encode())
            elif path.removeprefix("/camera/") in map(str, range(len(names))):
                picture = now[names[int(path.removeprefix("/camera/"))]]
                self.reply(HTTPStatus.OK, "image/jpeg", picture)
            else:
                super().answer(path)

    return Handler
