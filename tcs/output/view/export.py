"""The scene as one self-contained page with an animation of the members and their goals."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.geometry import Meshcat, MeshcatAnimation
from pydrake.math import RigidTransform

from tcs.output.view.floor import REACHABILITY, floor_map
from tcs.output.view.scene_objects import (
    FLOOR,
    SHOWN,
    SceneObjects,
    Snapshot,
    arrow_path,
    draw_floor,
)
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import REASON_COLOURS, REASON_NAMES, goals_text
from tcs.placement.tables import Reason

_RATE = 10
"""Frames per second; a change takes one frame."""
_HOLD = 15
"""Frames for which each goal is shown."""


@dataclass(frozen=True)
class PlayStep:
    """One step of the animation."""

    member: int
    """Number of the member of the set."""
    index: int
    """Flat index of its configuration."""
    goal: int
    """The goal that is shown."""


def play_steps(viewed: ViewedSet) -> tuple[PlayStep, ...]:
    """Return the steps of the animation: each member at each goal it serves.

    For a set without members (no goal is reached), the only step is the first configuration.
    """
    steps = [
        PlayStep(number, index, goal)
        for number, index in enumerate(viewed.members)
        for goal in viewed.served(number)
    ]
    return tuple(steps) or (PlayStep(0, 0, 0),)


def export_page(
    meshcat: Meshcat,
    objects: SceneObjects,
    viewed: ViewedSet,
    *,
    title: str,
    notes: Sequence[str] = (),
) -> str:
    """Return the page.

    The floor shows the reachability for the state of the environment of the member.

    Args:
        meshcat: An empty Meshcat.
        objects: The objects of the scene.
        viewed: The scores and the set.
        title: First line.
        notes: Further lines, such as the source and licence of the meshes.
    """
    steps = play_steps(viewed)
    shots = [objects.snapshot(step.index, step.goal) for step in steps]
    arrows = sorted(set().union(*(shot.arrows for shot in shots)))
    objects.set_up(meshcat, arrows, compact=True)
    for path, pose in shots[0].poses.items():
        meshcat.SetTransform(path, RigidTransform(pose))
    environments = [viewed.environment_state(step.index) for step in steps]
    for number in sorted(set(environments)):
        floor = floor_map(viewed, number, steps[0].goal, REACHABILITY)
        draw_floor(meshcat, floor, f"{FLOOR}/{number}")
    visible = [
        {f"{FLOOR}/{number}", *(arrow_path(arrow) for arrow in shot.arrows)}
        for number, shot in zip(environments, shots, strict=True)
    ]
    for path in set().union(*visible):
        meshcat.SetProperty(path, "visible", path in visible[0])
    if len(shots) > 1:
        meshcat.SetAnimation(_animation(shots, visible))
    panel = _panel(title, [*_captions(viewed, steps), *notes])
    return str(meshcat.StaticHtml()).replace("</body>", f"{panel}\n</body>", 1)


def _animation(shots: list[Snapshot], visible: list[set[str]]) -> MeshcatAnimation:
    """Return an animation of the snapshots, with the paths that are visible at each.

    The browser interpolates linearly between keys, so an object that changes gets a key right
    before the change: no object moves along a path that was never checked.
    """
    animation = MeshcatAnimation(_RATE)
    for path in shots[0].poses:
        poses = [shot.poses[path] for shot in shots]
        for number, pose in enumerate(poses):
            if number == 0 or (pose != poses[number - 1]).any():
                if number:
                    last = RigidTransform(poses[number - 1])
                    animation.SetTransform(number * _HOLD - 1, path, last)
                animation.SetTransform(number * _HOLD, path, RigidTransform(pose))
    # The animation ends with its last key; this one shows the last goal for as long as the others.
    end = RigidTransform(shots[-1].poses[SHOWN])
    animation.SetTransform(len(shots) * _HOLD, SHOWN, end)
    for path in sorted(set().union(*visible)):
        shown = [path in one for one in visible]
        for number, is_visible in enumerate(shown):
            if number == 0 or is_visible != shown[number - 1]:
                animation.SetProperty(number * _HOLD, path, "visible", is_visible)
    return animation


def _captions(viewed: ViewedSet, steps: tuple[PlayStep, ...]) -> list[str]:
    """Return a line for each member: its time in the animation, and its results."""
    lines = []
    for number, index in enumerate(viewed.members):
        times = [at * _HOLD / _RATE for at, one in enumerate(steps) if one.member == number]
        goals = [one.goal for one in steps if one.member == number]
        if times:
            until = times[-1] + _HOLD / _RATE
            line = viewed.result(index).summary
            shown = f"member {number + 1} at {goals_text(goals)}"
            lines.append(f"{times[0]:g} to {until:g} s: {shown}. Reached: {line}.")
    return lines or ["No configuration reaches a goal."]


def _panel(title: str, lines: list[str]) -> str:
    """Return title, lines and the legend of the arrows as an overlay."""
    # The browser may break the line at the spaces between the entries.
    colours = " ".join(
        '<span style="white-space:nowrap;margin-right:1em">'
        f'<span style="color:{REASON_COLOURS[one]}">&#9632;</span> {REASON_NAMES[one]}</span>'
        for one in Reason
    )
    return overlay(title, lines, f"<p>{colours}</p>")


def overlay(title: str, lines: Sequence[str], more: str = "") -> str:
    """Return title and lines of text as an HTML overlay.

    Args:
        title: First line, in bold.
        lines: Further lines.
        more: HTML below them, inserted unescaped.
    """
    paragraphs = "".join(f"<p>{html.escape(line)}</p>" for line in lines)
    return (
        "<style>#tcs{position:fixed;left:0;top:0;max-width:44em;margin:8px;padding:6px 10px;"
        "background:#ffffffdd;font:13px sans-serif;color:#222}#tcs p{margin:3px 0}</style>"
        f'<div id="tcs"><p><b>{html.escape(title)}</b></p>{paragraphs}{more}</div>'
    )
