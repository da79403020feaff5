"""The view of a score file: a selected set in its scene, live or as one page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tcs.files.writing import whole_file
from tcs.model.grid import InitialConfiguration
from tcs.output.report.score.pictures import title_of
from tcs.output.report.score.shown_set import ShownSet, scored_scenes
from tcs.output.view.export import export_page
from tcs.output.view.live import Viewer, open_meshcat, stay_open
from tcs.output.view.scene_objects import SceneObjects
from tcs.output.view.scene_page import ScenePage
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import colour_legend
from tcs.placement.store import ScoreFile


@dataclass(frozen=True, eq=False)
class ScoreView:
    """A set of a score file and the scene it is shown in."""

    viewed: ViewedSet
    objects: SceneObjects
    title: str
    """Task, environment and robot."""
    subtitle: str
    """The set and its scores."""
    source: str
    """Origin and licence of the robot's models."""
    meshes: bool
    """Whether the robot is shown with its meshes instead of its collision shapes."""


def make_score_view(
    file: ScoreFile,
    *,
    here: InitialConfiguration | None = None,
    max_members: int | None = None,
    observed: Mapping[str, float] | None = None,
    refined: bool = True,
    meshes: bool = False,
) -> ScoreView:
    """Return the view of a score file.

    Args:
        file: A score file.
        here: The current state; None if it is not known.
        max_members: Most members of the set; by default as many as the file holds.
        observed: Observed values of the observed axes [m or rad].
        refined: Whether a refined set may be shown.
        meshes: Whether to show the robot with its meshes.

    Raises:
        StoreError: If the file was made from other models.
        SelectionError: If there is no such set.
    """
    shown = ShownSet.of(file, here, max_members, observed, refined=refined)
    hands = scored_scenes(file, shown, meshes=meshes)
    job, scene = hands[0]
    viewed = ViewedSet.of_shown(shown)
    return ScoreView(
        viewed=viewed,
        objects=SceneObjects(
            scene,
            job.task,
            viewed,
            meshes=meshes,
            arms=[tuple(of_hand.job.spec.robot.arm_joints) for of_hand in hands],
        ),
        title=title_of(job, file),
        subtitle=shown.subtitle,
        source=job.spec.robot.source,
        meshes=meshes,
    )


def write_score_view(view: ScoreView, path: Path) -> dict[str, Any]:
    """Write a view as one self-contained page; return a summary of it as plain containers.

    A page with meshes states their origin and licence.

    Raises:
        OutputError: If the page cannot be written.
    """
    notes = [view.subtitle]
    if view.meshes:
        notes.append(
            "This page contains the robot's meshes, converted: every triangle at its original "
            f"position, without textures. Origin and licence, from the robot file: {view.source}"
        )
    text = export_page(
        open_meshcat(), view.objects, view.viewed, title=view.title, notes=notes
    ).encode()
    with whole_file(path, "Page") as stream:
        stream.write(text)
    return {
        "file": str(path),
        "bytes": len(text),
        "meshes": view.meshes,
        "members": [view.viewed.configuration(index).to_json() for index in view.viewed.members],
        "source": view.source if view.meshes else None,
    }


def show_score_view(
    view: ScoreView,
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
    on_line(f"{view.title}; {view.subtitle}")
    on_line(f"arrows: {colour_legend()}")
    viewer = Viewer(meshcat, view.objects, view.viewed, on_line)
    stay_open(page, lambda: viewer.run(duration), browser=browser, on_note=on_note)
