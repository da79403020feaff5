"""A recorded run as one self-contained page with an animation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydrake.geometry import Meshcat, MeshcatAnimation

from tcs.files.writing import whole_file
from tcs.output.view.animation import interpolation_keys, play_visible
from tcs.output.view.export import overlay, static_page
from tcs.output.view.live import open_meshcat
from tcs.output.view.teleop.panel import (
    COLOURS,
    LINES,
    Panel,
    Readout,
    bar,
    bar_properties,
)
from tcs.output.view.teleop.replay import RunView, load_run_view
from tcs.output.view.teleop.robot_display import TOOL, RobotDisplay
from tcs.teleop import Arm

_FRAME_RATE = 25
"""Frames per second of the page."""
_MOST_FRAMES = 3000
"""Greatest number of frames: longer runs have a lower rate, so that pages are below 10 MB."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedPage:
    """Summary of a page that was written."""

    size: int
    """Size of the page [bytes]."""
    samples: int
    """Samples of the run."""
    seconds: float
    """Duration of the run [s]."""
    source: str
    """Origin and licence of the robot's model, as its robot file states them."""


def export_run(path: Path, page: Path, robot: str | None = None, *, meshes: bool) -> ExportedPage:
    """Write a run as one page.

    Args:
        path: The run file.
        page: The page to write.
        robot: Name or YAML file of the robot; None for the one in the run's metadata.
        meshes: Whether the page shows the robot's meshes instead of its collision shapes.

    Raises:
        OutputError: If the page cannot be written.
        DataFileError: As `load_run_view`.
    """
    view = load_run_view(path, robot)
    file = view.arm.robot
    notes = [view.summary]
    if meshes:
        notes.append(
            "This page contains the robot's meshes, converted: every triangle at its original "
            f"position, without textures. Origin and licence, from the robot file: {file.source}"
        )
    display = RobotDisplay(view.arm, meshes=meshes)
    text = replay_page(open_meshcat(), display, view, title=file.title, notes=notes).encode()
    with whole_file(page, "Page") as stream:
        stream.write(text)
    return ExportedPage(
        size=len(text), samples=len(view.run), seconds=view.length, source=file.source
    )


def replay_page(
    meshcat: Meshcat, display: RobotDisplay, view: RunView, *, title: str, notes: Sequence[str] = ()
) -> str:
    """Return a page that plays the run without a server.

    Args:
        meshcat: An empty Meshcat.
        display: The robot.
        view: The run.
        title: First line.
        notes: Further lines.
    """
    rate = min(_FRAME_RATE, _MOST_FRAMES / max(view.length, 1e-9))
    count = math.ceil(view.length * rate) + 1
    samples = [view.sample(number / rate) for number in range(count)]
    display.set_up(meshcat, view.run.position[0], target=False, compact=True)
    view.draw(meshcat)
    panel = Panel(meshcat, view.arm)
    readouts = [view.readout(i) for i in samples]
    panel.show(readouts[0])
    shots = [{**display.poses(view.run.joints[i]), TOOL: view.tool(i)} for i in samples]
    for path, pose in shots[0].items():
        meshcat.SetTransform(path, pose)
    animation = MeshcatAnimation(rate)
    for path in shots[0]:
        poses = [shot[path].GetAsMatrix34() for shot in shots]
        for at in interpolation_keys([pose.tobytes() for pose in poses]):
            animation.SetTransform(at, path, shots[at][path])
    _play_bars(animation, view.arm, readouts)
    _play_lines(animation, panel, readouts)
    meshcat.SetAnimation(animation)
    text = overlay(title, notes, plays=True)
    return static_page(meshcat, text)


def _play_bars(animation: MeshcatAnimation, arm: Arm, readouts: list[Readout]) -> None:
    """Animate the lengths and colours of the bars."""
    for i, bounded in enumerate(arm.bounded):
        fractions = [one.fractions[i] for one in readouts]
        for at in interpolation_keys(fractions):
            for path, name, value in bar_properties(i, fractions[at], bool(bounded)):
                animation.SetProperty(at, path, name, value)
        states = [one.states[i] for one in readouts]
        for state in COLOURS:
            play_visible(animation, f"{bar(i)}/{state}", [one == state for one in states])


def _play_lines(animation: MeshcatAnimation, panel: Panel, readouts: list[Readout]) -> None:
    """Animate the lines of text."""
    for line in LINES:
        texts = [getattr(one, line) for one in readouts]
        for text in dict.fromkeys(texts):
            path = panel.text(line, text)
            if path:
                play_visible(animation, path, [one == text for one in texts])
