"""The panel: seven joint bars and messages for the operator, fixed to the camera.

Its objects are children of Meshcat's camera, so they keep their place in the image, also in an
exported page. Lengths on the panel are fractions of half the image's height.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, Rgba
from pydrake.math import RigidTransform

from tcs.output.view.teleop.text import ADVANCE, text_mesh
from tcs.teleop import Arm
from tcs.teleop.control.state import ShortArray, range_fraction

FloatArray = NDArray[np.float64]
PANEL = "/Cameras/default/rotated/<object>/panel"
"""Path of the panel, a child of the camera, with which it moves."""
FREE, LIMIT, SINGULAR = "free", "limit", "singular"
COLOURS: Mapping[str, str] = {FREE: "#2ca02c", LIMIT: "#ff2020", SINGULAR: "#ff00ff"}
"""Colours of a bar, as in the paper: green, red at a limit, magenta at a singularity."""
_TRACKS: Mapping[str, str] = {FREE: "#c8ccd4", LIMIT: "#ff9a9a", SINGULAR: "#ffa6ff"}
"""Colours of the rest of a joint's range, visible where the bar is short."""
_WORDS: Mapping[str, str] = {LIMIT: "limit", SINGULAR: "singular"}
"""Words on a bar, by which its state is told apart without its colour."""
LINES = ("mode", "message")
_INK = {"mode": "#ffffff", "message": "#ffd24d"}
_DISTANCE = 0.05
"""Distance from the camera [m]: beyond its near plane (0.01 m), in front of the scene."""
_HALF_HEIGHT = math.tan(math.radians(37.5))
"""Half the height of the view of Meshcat's camera (75 degrees) at a distance of 1."""
_WIDTH, _BOTTOM, _TOP = 1.56, -0.92, -0.48
"""Width, bottom and top of the panel; it fits into windows that are not much higher than wide."""
_BAR = (0.185, 0.04)
"""Width and height of a bar."""
_PITCH = _WIDTH / 7.0
_BARS_AT, _NAMES_AT, _ENDS_AT = -0.815, -0.765, -0.895
_MARK = 0.012
"""Width of the mark at the joint's position: visible where the bar has no length."""
_LINE_AT = {"mode": -0.55, "message": -0.625}
_FONT, _SMALL = 0.044, 0.034
_MOST_LETTERS = int((_WIDTH - 0.06) / (_FONT * ADVANCE))
_KEPT = 40
"""Number of hidden lines of text kept in Meshcat for reuse."""


@dataclass(frozen=True, slots=True)
class Readout:
    """Content of the panel."""

    fractions: tuple[float, ...]
    """Position of each joint in its range, 0 to 1."""
    states: tuple[str, ...]
    """`FREE`, `LIMIT` or `SINGULAR` of each joint."""
    mode: str
    """The control mode in one line."""
    message: str
    """Message for the operator; may be empty."""


def readout(
    arm: Arm, joints: FloatArray, limits: ShortArray, singular: bool, mode: str, message: str
) -> Readout:
    """Return the panel's content for a posture.

    A singularity belongs to the posture, not to a joint: every bar that is not red turns magenta.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        limits: -1 where a joint is at its lower limit, 1 at its upper one, else 0; shape (7,).
        singular: Whether the posture is singular.
        mode: The control mode in one line.
        message: Message for the operator.
    """
    # A continuous joint is shown from -pi to pi.
    turned = (np.asarray(joints) + math.pi) % (2.0 * math.pi) / (2.0 * math.pi)
    fractions = np.where(arm.bounded, range_fraction(arm, np.asarray(joints)), turned)
    other = SINGULAR if singular else FREE
    states = tuple(LIMIT if flag else other for flag in limits)
    return Readout(tuple(np.clip(fractions, 0.0, 1.0).tolist()), states, mode, message)


def state_facts(limits: ShortArray, singular: bool) -> str:
    """Return which joints are at a limit and whether the posture is singular, as text.

    >>> state_facts(np.array([0, 1, 0, -1, 0, 0, 0]), True)
    'at its limit: joint 2 (upper), joint 4 (lower); singular posture'
    """
    at = [
        f"joint {i + 1} ({'upper' if flag > 0 else 'lower'})"
        for i, flag in enumerate(limits)
        if flag
    ]
    facts = [f"at its limit: {', '.join(at)}"] if at else []
    return "; ".join([*facts, "singular posture"] if singular else facts)


def mode_line(mode: str, group: tuple[int, ...] | None, number: int, clutch: bool) -> str:
    """Return the control mode in one line.

    Args:
        mode: Name of the mode.
        group: Joints of the selected group, counted from 0; None if none is selected.
        number: Number of that group, counted from 0.
        clutch: Whether the clutch decouples master and slave.

    >>> mode_line("null-space", (0, 1, 2), 0, False)
    'null-space mode, group 1 (joints 1 2 3)'
    """
    line = f"{mode} mode"
    if group is not None:
        joints = " ".join(str(joint + 1) for joint in group)
        line += f", group {number + 1} (joints {joints})"
    return f"{line}; clutch engaged" if clutch else line


class Panel:
    """The panel of one arm in one Meshcat."""

    def __init__(self, meshcat: Meshcat, arm: Arm) -> None:
        """Draw the constant parts.

        Args:
            meshcat: The Meshcat.
            arm: The arm whose joints the panel shows.
        """
        self._meshcat = meshcat
        self._bounded = arm.bounded
        self._shown: Readout | None = None
        self._texts: dict[str, dict[str, str]] = {line: {} for line in LINES}
        self._written = 0
        meshcat.SetTransform(PANEL, RigidTransform([0.0, 0.0, -_DISTANCE]))
        scale = _DISTANCE * _HALF_HEIGHT
        meshcat.SetProperty(PANEL, "scale", [scale, scale, scale])
        self._quad("back", "#20242c", _WIDTH, _TOP - _BOTTOM, (0.0, 0.5 * (_TOP + _BOTTOM), 0.0))
        for i in range(len(arm.joints)):
            self._draw_bar(arm, i)

    def show(self, now: Readout) -> None:
        """Show a readout; only changes are sent."""
        before = self._shown
        for i, (fraction, state) in enumerate(zip(now.fractions, now.states, strict=True)):
            if before is None or before.states[i] != state:
                for one in COLOURS:
                    self._meshcat.SetProperty(f"{bar(i)}/{one}", "visible", one == state)
            if before is None or before.fractions[i] != fraction:
                for path, name, value in bar_properties(i, fraction, bool(self._bounded[i])):
                    self._meshcat.SetProperty(path, name, value)
        for line, text in (("mode", now.mode), ("message", now.message)):
            if before is None or getattr(before, line) != text:
                self._show_text(line, text)
        self._shown = now

    def text(self, line: str, text: str) -> str:
        """Write a text, hidden, and return its path; empty for an empty text.

        Args:
            line: One of `LINES`.
            text: The text.
        """
        known = self._texts[line]
        if not text:
            return ""
        if text not in known:
            self._written += 1
            path = f"{PANEL}/{line}/{self._written}"
            rows = textwrap.wrap(text, _MOST_LETTERS)
            # Text longer than two rows is written smaller.
            font = _FONT
            if len(rows) > 2:
                rows = textwrap.wrap(text, math.ceil(len(text) / 2) + 8)[:2]
                font = (_WIDTH - 0.06) / (ADVANCE * max(len(row) for row in rows))
            for number, row in enumerate(rows):
                at = (0.03 - 0.5 * _WIDTH, _LINE_AT[line] - 1.35 * font * number, 0.004)
                self._write(f"{path}/{number}", row, _INK[line], font, at)
            self._meshcat.SetProperty(path, "visible", False)
            known[text] = path
        return known[text]

    def _show_text(self, line: str, text: str) -> None:
        """Show a text in a line, hide the one before, and delete the least recent ones."""
        path = self.text(line, text)
        known = self._texts[line]
        for other, other_path in list(known.items()):
            if other_path == path:
                # Move the latest text to the end: the least recent one is deleted first.
                known[other] = known.pop(other)
            elif self._shown is not None and getattr(self._shown, line) == other:
                self._meshcat.SetProperty(other_path, "visible", False)
        if path:
            self._meshcat.SetProperty(path, "visible", True)
        while len(known) > _KEPT:
            self._meshcat.Delete(known.pop(next(iter(known))))

    def _draw_bar(self, arm: Arm, i: int) -> None:
        """Draw the bar of a joint in all its colours, its name and its limits."""
        width, height = _BAR
        x = bar_middle(i)
        self._meshcat.SetTransform(bar(i), RigidTransform([x - 0.5 * width, _BARS_AT, 0.0]))
        middle = 0.5 * width
        for state, colour in COLOURS.items():
            frame = (middle, 0.0, 0.001)
            self._quad(f"bar/{i}/{state}/frame", colour, width + 0.02, height + 0.02, frame)
            track = (middle, 0.0, 0.002)
            self._quad(f"bar/{i}/{state}/track", _TRACKS[state], width, height, track)
            if self._bounded[i]:
                self._quad(f"bar/{i}/{state}/fill", colour, width, height, (middle, 0.0, 0.003))
            if state in _WORDS:
                # Centred on the bar.
                word = _WORDS[state]
                begin = (middle - 0.5 * ADVANCE * _SMALL * len(word), -0.4 * _SMALL, 0.004)
                self._write(f"{bar(i)}/{state}/word", word, "#101010", _SMALL, begin)
        self._quad(f"bar/{i}/mark", "#101010", _MARK, height + 0.05, (0.0, 0.0, 0.005))
        name = f"joint {i + 1}"
        left = x - 0.5 * width
        self._write(f"{PANEL}/name/{i}", name, "#ffffff", _SMALL, (left, _NAMES_AT, 0.004))
        ends = _degrees(arm, i)
        for number, text in enumerate(ends):
            at = left if number == 0 else left + width - ADVANCE * _SMALL * len(text)
            self._write(f"{PANEL}/end/{i}/{number}", text, "#b8c0cc", _SMALL, (at, _ENDS_AT, 0.004))

    def _quad(
        self, name: str, colour: str, width: float, height: float, at: tuple[float, float, float]
    ) -> None:
        x, y = 0.5 * width, 0.5 * height
        # Drawn from its left end, so that a scale along x changes its length.
        corners = np.array([[-x, x, x, -x], [-y, -y, y, y], [0.0, 0.0, 0.0, 0.0]])
        faces = np.array([[0, 0], [1, 2], [2, 3]], dtype=np.int32)
        corners[0] += at[0]
        corners[1] += at[1]
        corners[2] += at[2]
        self._draw(f"{PANEL}/{name}", corners, faces, colour)

    def _write(
        self, path: str, text: str, colour: str, font: float, at: tuple[float, float, float]
    ) -> None:
        corners, faces = text_mesh(text)
        self._draw(path, font * corners + np.array(at)[:, None], faces, colour)

    def _draw(self, path: str, corners: FloatArray, faces: NDArray[np.int32], colour: str) -> None:
        """Draw emissive triangles: no light of the scene changes their colour."""
        self._meshcat.SetTriangleMesh(
            path, np.asfortranarray(corners), np.asfortranarray(faces), Rgba(0.0, 0.0, 0.0)
        )
        for channel, value in zip("rgb", to_rgb(colour), strict=True):
            # Meshcat adds light linearly and applies the sRGB transfer function to the sum.
            light = value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
            self._meshcat.SetProperty(f"{path}/<object>", f"material.emissive.{channel}", light)
            self._meshcat.SetProperty(f"{path}/<object>", f"material.specular.{channel}", 0.0)
        self._meshcat.SetProperty(f"{path}/<object>", "material.toneMapped", False)


def bar(i: int) -> str:
    """Return the path of a joint's bar."""
    return f"{PANEL}/bar/{i}"


def bar_middle(i: int) -> float:
    """Return the position of the middle of a joint's bar along the panel."""
    return (i - 3.0) * _PITCH


def bar_properties(i: int, fraction: float, bounded: bool) -> list[tuple[str, str, list[float]]]:
    """Return the properties that set a bar to the position of its joint: path, property, value.

    Args:
        i: Number of the joint, from 0.
        fraction: Position of the joint in its range, 0 to 1.
        bounded: Whether the joint has limits; if not, the bar has a mark and no fill.
    """
    found = [(f"{bar(i)}/mark", "position", [fraction * _BAR[0], 0.0, 0.0])]
    for state in COLOURS if bounded else ():
        # A scale of exactly 0 has no inverse, for which the browser prints a warning.
        found.append((f"{bar(i)}/{state}/fill", "scale", [max(fraction, 1e-3), 1.0, 1.0]))
    return found


def _degrees(arm: Arm, i: int) -> tuple[str, str]:
    """Return the limits of a joint in degrees, as text."""
    if not arm.bounded[i]:
        return "continuous", ""
    return f"{math.degrees(arm.lower[i]):+.0f}", f"{math.degrees(arm.upper[i]):+.0f}"
