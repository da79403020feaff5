"""The scene as one self-contained page with an animation of the members and their goals."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
from matplotlib.colors import to_hex
from pydrake.geometry import Meshcat, MeshcatAnimation
from pydrake.math import RigidTransform

from tcs.output.draw import Category
from tcs.output.draw.colours import SCALE
from tcs.output.view.floor import REACHABILITY, floor_map
from tcs.output.view.scene_objects import (
    FLOOR,
    MEMBER_COLOUR,
    SHOWN,
    SceneObjects,
    Snapshot,
    arrow_path,
    draw_floor,
)
from tcs.output.view.shapes import ARM_COLOUR
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import REASON_COLOURS, REASON_NAMES, goals_text
from tcs.placement.tables import Reason

VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
"""Pixels of a phone are those of its screen."""
_RATE = 10
"""Frames per second; a change takes one frame."""
_HOLD = 15
"""Frames for which each goal is shown."""
_PAUSE = """<button type="button" id="tcs-pause">Pause</button><script>{
const button = document.getElementById("tcs-pause");
const say = () => { button.textContent = viewer.animator.playing ? "Pause" : "Play"; };
button.onclick = () => {
  const animator = viewer.animator;
  if (animator.playing) animator.pause();
  else {
    if (animator.time >= animator.duration - 0.05) animator.reset();
    animator.play();
  }
  say();
};
setInterval(say, 500);
}</script>"""
"""Button that pauses the animation of Meshcat, whose own control is in a closed folder."""


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
    panel = _panel(title, [*_captions(viewed, steps), *notes], plays=len(shots) > 1)
    return static_page(meshcat, panel)


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


def _panel(title: str, lines: list[str], *, plays: bool) -> str:
    """Return title, lines and the legend of what is shown as an overlay."""
    # The browser may break the line at the spaces between the entries.
    arrows = " ".join(swatch(REASON_COLOURS[one], REASON_NAMES[one]) for one in Reason)
    objects = " ".join(
        swatch(category.colour, category.label)
        for category in (Category.PERSON, Category.FURNITURE, Category.ROBOT)
    )
    objects += f" {swatch(ARM_COLOUR, Category.ARM.label)}"
    marks = " ".join(
        swatch(colour, text)
        for colour, text in (
            (MEMBER_COLOUR, "outline: where the base stands"),
            (Category.CURRENT_GOAL.colour, "sphere: goal shown"),
        )
    )
    more = (
        f"<p>Arrows: {arrows}</p><p>Floor: P_R of a base there, {_gradient()} none to the best; "
        f"without colour: no goal.</p><p>{objects} {marks}</p>"
    )
    return overlay(title, lines, more, plays=plays)


def swatch(colour: str, text: str) -> str:
    """Return an entry of a legend as HTML: a square of a colour, and what it means."""
    return (
        '<span style="white-space:nowrap;margin-right:1em"><span style="display:inline-block;'
        f'width:.8em;height:.8em;border:1px solid #555;background:{colour}"></span> '
        f"{html.escape(text)}</span>"
    )


def _gradient() -> str:
    """Return the colours of the floor, from none to the best, as HTML."""
    scale = matplotlib.colormaps[SCALE]
    stops = ",".join(to_hex(scale(fraction)) for fraction in (0.0, 0.25, 0.5, 0.75, 1.0))
    return (
        '<span style="display:inline-block;width:7em;height:.8em;border:1px solid #555;'
        f'background:linear-gradient(90deg,{stops})"></span>'
    )


def static_page(meshcat: Meshcat, panel: str) -> str:
    """Return what a Meshcat shows as one page, with HTML over it; on a phone too."""
    page = str(meshcat.StaticHtml()).replace("<head>", f"<head>{VIEWPORT}", 1)
    return page.replace("</body>", f"{panel}\n</body>", 1)


def overlay(title: str, lines: Sequence[str], more: str = "", *, plays: bool = False) -> str:
    """Return title and lines of text as an HTML overlay.

    Args:
        title: First line, in bold.
        lines: Further lines.
        more: HTML below them, inserted unescaped.
        plays: Whether the page has an animation, for which there is a button to pause.
    """
    paragraphs = "".join(f"<p>{html.escape(line)}</p>" for line in lines)
    return (
        "<style>#tcs{position:fixed;left:0;top:0;max-width:min(44em,calc(100vw - 16px));margin:8px;"
        "max-height:calc(100vh - 16px);overflow:auto;box-sizing:border-box;padding:6px 10px;"
        "background:#ffffffdd;font:13px sans-serif;color:#222}#tcs p{margin:3px 0}"
        "#tcs summary{cursor:pointer;font-weight:bold;padding:6px 0}"
        "#tcs button{min-width:6em;min-height:44px;font:inherit}</style>"
        f'<div id="tcs">{_PAUSE if plays else ""}'
        f"<details><summary>{html.escape(title)}</summary>{paragraphs}{more}</details></div>"
        "<script>document.querySelector('#tcs details').open = innerWidth > 700;</script>"
    )
