"""What `tcs view` does: a score file becomes a scene in the browser."""

from __future__ import annotations

import time
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

import tcs
from tcs.cli.values import observed_settings
from tcs.files.writing import whole_file
from tcs.model.grid import InitialConfiguration
from tcs.output import terminal
from tcs.output.report.pictures import scored_scene, title_of
from tcs.output.report.shown_set import ShownSet
from tcs.output.view import SceneObjects, ViewedSet, Viewer, export_page, open_meshcat
from tcs.output.words import colour_legend


@dataclass(frozen=True, eq=False)
class Staged:
    """A score file, ready to be shown."""

    answers: ViewedSet
    props: SceneObjects
    title: str
    """Task, environment, robot."""
    subtitle: str
    """The set, and its scores."""
    source: str
    """Where the robot's models come from, and under which licence."""


def stage(
    path: Path,
    here: InitialConfiguration | None,
    max_members: int | None,
    observed: Sequence[str],
    *,
    meshes: bool,
) -> Staged:
    """Return what a score file answers, and the scene to show it in.

    Args:
        path: The score file.
        here: Where the robot is now, if that matters to the choice of the set.
        max_members: Most members of the set.
        observed: How the person is found: "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].
        meshes: Whether the robot is shown as its meshes.

    Raises:
        StoreError: If the file cannot be used, or the models are not those it was made from.
        SelectionError: If no such set can be chosen.
    """
    file = tcs.load(path)
    shown = ShownSet.of(file, here, max_members, observed_settings(observed, file.observed_axes))
    job, scene = scored_scene(file, shown, meshes=meshes)
    answers = ViewedSet.of(file, shown.table, shown.indices)
    return Staged(
        answers,
        SceneObjects(scene, job.task, answers, meshes=meshes),
        title_of(job),
        shown.subtitle,
        job.spec.robot.source,
    )


def export(staged: Staged, path: Path, *, meshes: bool) -> dict[str, Any]:
    """Write the scene as one page and return what was written.

    Args:
        staged: The scene, built with the robot's meshes or without.
        path: The page to write.
        meshes: Whether it was built with them; the page then says whose they are.

    Raises:
        OutputError: If it cannot be written there.
    """
    notes = [staged.subtitle]
    if meshes:
        notes.append(
            "This page holds the robot's meshes in another format: every triangle in its place, no "
            f"textures. Its robot file says of them: {staged.source}"
        )
    text = export_page(
        open_meshcat(), staged.props, staged.answers, title=staged.title, notes=notes
    ).encode()
    with whole_file(path, "Page") as stream:
        stream.write(text)
    return {
        "file": str(path),
        "bytes": len(text),
        "meshes": meshes,
        "members": [
            staged.answers.grid.configuration(index).to_json() for index in staged.answers.members
        ],
        "source": staged.source if meshes else None,
    }


def report_page(result: dict[str, Any]) -> None:
    """Print what was written, and whose meshes went into it."""
    typer.echo(f"wrote {result['file']}: {result['bytes'] / 1e6:.1f} MB")
    if result["meshes"]:
        typer.echo(
            "It holds the robot's meshes; mind their licence when you pass it on. Its robot file "
            f"says of them: {result['source']}"
        )


def show_live(staged: Staged, *, port: int | None, browser: bool, duration: float | None) -> None:
    """Open the viewer and answer its controls until Ctrl-C, or for `duration` [s].

    Raises:
        OutputError: If it cannot listen at that port.
    """
    begun = time.perf_counter()
    meshcat = open_meshcat(port)
    typer.echo(f"{staged.title}; {staged.subtitle}")
    typer.echo(f"arrows: {colour_legend()}")
    viewer = Viewer(meshcat, staged.props, staged.answers, typer.echo)
    terminal.note(f"open {meshcat.web_url()} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(meshcat.web_url())
    try:
        viewer.run(duration)
    except KeyboardInterrupt:
        terminal.note(f"closed after {time.perf_counter() - begun:.0f} s.")
