"""Score a task in the room as it is found, and write its file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tcs
from tcs.cli import reports, talk
from tcs.cli.places import check_writable, frame_places, observed_settings, settings
from tcs.cli.rows import saved_summary
from tcs.cli.talk import paper
from tcs.model.grid import Axis
from tcs.model.scene import EnvironmentFile, load_environment
from tcs.output.words import settings_text
from tcs.placement.scoring import default_path


def live_path(task: str, environment: str, robot: str) -> Path:
    """Return the name of a file scored live: not that of the file scored offline."""
    path = default_path(task, environment, robot)
    return path.with_stem(f"{path.stem}-live")


def score_found(
    task: str,
    environment: str,
    robot: str,
    path: Path,
    *,
    observed: Sequence[str],
    seen: Sequence[str],
    at: Sequence[str],
    jobs: int,
    **sets: Any,
) -> dict[str, Any]:
    """Score a task in the room as it is found, write its file and return the summary.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.
        path: File to write.
        observed: Values of joints as "AXIS=VALUE" [m] or "AXIS_deg=VALUE" [deg].
        seen: Frames as "FRAME=X,Y,Z" or "FRAME=X,Y,Z,QW,QX,QY,QZ" [m].
        at: How the axes of the room were set when the frames were seen, as `observed`.
        jobs: Number of threads.
        **sets: Options of `tcs.score` that say which sets are kept.

    Raises:
        OutputError: If the file cannot be written, before anything is scored.
        TcsError: Whatever `tcs.LiveScorer` raises.
    """
    check_writable(path)
    room = load_environment(environment)
    observation = tcs.Observation(
        joints=observed_settings(observed, _joints(room)),
        frames=frame_places(seen),
        setting=settings(at, "--at"),
    )
    scorer = tcs.LiveScorer(
        task,
        environment,
        robot,
        jobs=jobs,
        **sets,
        on_compile=talk.say_compiling,
    )
    file = scorer.score(observation)
    tcs.save(path, file)
    return {**saved_summary(path, file), "observation": file.metadata["observation"]}


def _joints(room: EnvironmentFile) -> list[Axis]:
    """Return the joints that may be found off their place, with their units."""
    off = [
        Axis(name, "m" if error.std_deg is None else "deg", 0.0, 0.0, 1)
        for name, error in room.errors.items()
    ]
    return [*off, *room.observed_axes]


def report_found(result: dict[str, Any]) -> None:
    """Print the summary of what was scored, and how the room was taken to be."""
    told = result["observation"]
    state = result["tables"][0]["observed"]
    moved = {key: float(f"{value:.4g}") for key, value in state.items() if value}
    paper().print(f"scored as found: {settings_text(moved) or 'everything in its place'}")
    if told["frame_position_error"] is not None:
        turned = told["frame_rotation_error"]
        angle = "" if turned is None else f" and {math.degrees(turned):.1f} deg"
        paper().print(f"frames seen fit to {told['frame_position_error']:.4f} m{angle}")
    reports.report_scores(result)
