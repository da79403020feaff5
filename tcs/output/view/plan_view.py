"""A plan in Meshcat: its motions as they are timed, live or as one page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.geometry import Meshcat, MeshcatAnimation, Rgba
from pydrake.math import RigidTransform
from scipy.interpolate import CubicHermiteSpline

from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.model.scene import Scene
from tcs.motion import MotionPlan, StopPlan
from tcs.motion.plan_check import hands_of
from tcs.output.report.score.pictures import job_title
from tcs.output.view.animation import play_poses, play_visible
from tcs.output.view.export import overlay, static_page, swatch
from tcs.output.view.live import open_meshcat, stay_open, wait
from tcs.output.view.scene_objects import SceneShapes, arrow_path, place
from tcs.output.view.scene_page import ScenePage
from tcs.output.view.swept import swept_mesh
from tcs.output.words import REASON_COLOURS, base_pose_text, goals_text
from tcs.output.words.success import not_done_text
from tcs.placement.scoring.job import whole_task
from tcs.placement.tables import Reason

RATE = 15
"""Frames per second, between which the browser interpolates."""
_MOST_FRAMES = 3000
"""Greatest number of frames: longer plans have a lower rate, so that pages stay below 10 MB."""
_HOLD = 1.0
"""Time for which a stop is shown after its motions, and one at which nothing can be done [s]."""
_SWEPT = "swept volume"
_SWEPT_COLOUR = Rgba(0.0, 0.45, 0.7, 0.15)
_DONE, _NOT_DONE = Reason.REACHED, Reason.ARM_BLOCKED
"""Reasons whose colours the arrows have: green and dark orange."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of the animation."""

    stop: int
    """Number of the stop."""
    joints: FloatArray | None
    """The arm [rad], shape (7,); None for its rest posture."""
    goal: int
    """The goal that the arm goes to, or comes from on its way back to rest."""


@dataclass(frozen=True, eq=False)
class PlanView:
    """A plan and the scene it is shown in."""

    plan: MotionPlan
    shapes: SceneShapes
    title: str
    """Task, environment and robot."""
    source: str
    """Origin and licence of the robot's models."""
    meshes: bool
    """Whether the robot is shown with its meshes instead of its collision shapes."""
    swept: bool
    """Whether the volume that the arm sweeps is shown."""
    scenes: Mapping[str, Scene]
    """The scene of each hand, by its name. That of the first one is shown, with all arms."""

    def arm_of(self, stop: StopPlan) -> tuple[str, ...]:
        """Return the joints of the arm that moves at a stop; () for that of the shown scene."""
        return () if stop.hand == next(iter(self.scenes)) else stop.joints

    @property
    def lines(self) -> list[str]:
        """When each stop is shown and what is done there, and why goals are not done."""
        lines, begin = [], 0.0
        for number, stop in enumerate(self.plan.stops, start=1):
            end = begin + stop.duration + _HOLD
            done = f"{goals_text(stop.goals)} done" if stop.goals else "nothing can be done"
            at = base_pose_text(stop.at.to_json())
            lines.append(f"{begin:.1f} to {end:.1f} s: stop {number} at {at}, {done}")
            begin = end
        lines += [not_done_text(one.to_json()) for one in self.plan.results if not one.done]
        found = f"Drake re-checked {self.plan.edges:,} edges, {self.plan.false} of them false."
        return [*lines, found]


def make_plan_view(plan: MotionPlan, *, meshes: bool = False, swept: bool = False) -> PlanView:
    """Return the view of a plan.

    Args:
        plan: The plan, e.g. from `load_plan`.
        meshes: Whether to show the robot with its meshes.
        swept: Whether to show the volume that the arm sweeps at each stop.

    Raises:
        StoreMismatchError: If the models have changed since the plan was made.
        StoreFormatError: If it names goals, joints or axes that its scene does not have.
    """
    hands = hands_of(plan, meshes=meshes)
    job, scene, _ = next(iter(hands.values()))
    shapes = SceneShapes(scene, whole_task([hand.job for hand in hands.values()]), meshes=meshes)
    return PlanView(
        plan,
        shapes,
        job_title(job),
        job.spec.robot.source,
        meshes,
        swept,
        {name: hand.scene for name, hand in hands.items()},
    )


def plan_frames(plan: MotionPlan, rate: float) -> tuple[Frame, ...]:
    """Return the frames of a plan, stop by stop.

    Args:
        plan: The plan.
        rate: Frames per second.
    """
    frames: list[Frame] = []
    for number, stop in enumerate(plan.stops):
        shown: list[Frame] = []
        if stop.segments:
            samples = stop.samples()
            at = np.append(np.arange(0.0, stop.duration, 1.0 / rate), stop.duration)
            joints = CubicHermiteSpline(samples.times, samples.positions, samples.velocities)(at)
            goals = _goals_at(stop, at)
            shown = [Frame(number, q, goal) for q, goal in zip(joints, goals, strict=True)]
        last = shown[-1] if shown else Frame(number, None, 0)
        frames += [*shown, *([last] * max(round(_HOLD * rate), 1))]
    return tuple(frames)


def show_plan(view: PlanView, meshcat: Meshcat, *, compact: bool = False) -> None:
    """Add the scene and the animation of a plan to an empty Meshcat.

    Args:
        view: The view.
        meshcat: An empty Meshcat.
        compact: Whether meshes are sent as bare triangles.
    """
    plan, shapes = view.plan, view.shapes
    rate = min(RATE, _MOST_FRAMES / max(sum(stop.duration for stop in plan.stops), 1.0))
    frames = plan_frames(plan, rate)
    arrows = [(one.goal, _DONE if one.done else _NOT_DONE) for one in plan.results]
    shapes.draw(meshcat, arrows, [stop.at for stop in plan.stops], compact=compact)
    for arrow in arrows:
        meshcat.SetProperty(arrow_path(arrow), "visible", True)
    stops = plan.stops
    shots = [
        shapes.poses(stops[one.stop].at, one.joints, one.goal, view.arm_of(stops[one.stop]))
        for one in frames
    ]
    for path, pose in shots[0].items():
        meshcat.SetTransform(path, RigidTransform(pose))
    animation = MeshcatAnimation(rate)
    play_poses(animation, shots)
    if view.swept:
        _play_swept(view, meshcat, animation, frames)
    meshcat.SetAnimation(animation)


def write_plan_view(view: PlanView, path: Path) -> dict[str, Any]:
    """Write a view as one self-contained page; return a summary of it as plain containers.

    Raises:
        OutputError: If the page cannot be written.
    """
    meshcat = open_meshcat()
    show_plan(view, meshcat, compact=True)
    notes = list(view.lines)
    if view.meshes:
        notes.append(
            f"This page contains the robot's meshes. Origin and licence, from the robot file: "
            f"{view.source}"
        )
    colours = " ".join(
        swatch(REASON_COLOURS[one], text)
        for one, text in ((_DONE, "done"), (_NOT_DONE, "not done"))
    )
    panel = overlay(view.title, notes, f"<p>{colours}</p>", plays=True)
    page = static_page(meshcat, panel).encode()
    with whole_file(path, "Page") as stream:
        stream.write(page)
    return {
        "file": str(path),
        "bytes": len(page),
        "meshes": view.meshes,
        "members": [stop.at.to_json() for stop in view.plan.stops],
        "source": view.source if view.meshes else None,
    }


def show_plan_view(
    view: PlanView,
    *,
    port: int | None = None,
    browser: bool = True,
    duration: float | None = None,
    on_line: Callable[[str], None],
    on_note: Callable[[str], None],
) -> None:
    """Show a view in a live viewer until Ctrl-C, or for a duration.

    Args:
        view: The view.
        port: Port of the viewer; by default 7000, or a free one.
        browser: Whether to open a browser.
        duration: Time until the viewer closes [s]; None until Ctrl-C.
        on_line: Called with each line about what is shown.
        on_note: Called with the address of the viewer, and with a note when Ctrl-C closes it.

    Raises:
        OutputError: If the viewer cannot listen at that port.
    """
    meshcat = open_meshcat(hidden=True)
    page = ScenePage(meshcat, port)
    show_plan(view, meshcat)
    for line in (view.title, *view.lines):
        on_line(line)
    stay_open(page, lambda: wait(duration), browser=browser, on_note=on_note)


def _goals_at(stop: StopPlan, times: FloatArray) -> list[int]:
    """Return the goal of the segment at each time from the begin of a stop."""
    ends = np.cumsum([segment.timing.duration for segment in stop.segments])
    numbers = np.minimum(np.searchsorted(ends, times, side="right"), len(ends) - 1)
    goals = [one.start if one.end is None else one.end for one in stop.segments]
    return [goals[number] or 0 for number in numbers]


def _play_swept(
    view: PlanView, meshcat: Meshcat, animation: MeshcatAnimation, frames: Sequence[Frame]
) -> None:
    """Add the volume that the arm sweeps at each stop, shown while the stop is."""
    for number, stop in enumerate(view.plan.stops):
        if not stop.segments:
            continue
        scene = view.scenes[stop.hand]
        place(scene, stop.at)
        corners, faces = swept_mesh(scene, stop.samples().positions)
        path = f"{_SWEPT}/{number}"
        meshcat.SetTriangleMesh(path, corners, faces, _SWEPT_COLOUR)
        meshcat.SetProperty(path, "visible", number == frames[0].stop)
        play_visible(animation, path, [one.stop == number for one in frames])
