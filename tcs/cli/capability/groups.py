"""Options that the commands on capability maps share, and those for errors of base and task."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.files.writing import check_writable

if TYPE_CHECKING:
    from tcs.capability import (
        BasePose,
        CapabilityMap,
        GraspTask,
        MapGrid,
        PoseErrors,
        Reach,
        Surroundings,
    )

Map = Annotated[Path, typer.Argument(metavar="MAP", help="A capability map.")]
Radius = Annotated[
    float | None,
    typer.Option(
        help="Greatest distance of the tool from the shoulder, in metres; the thesis uses 0.9.",
        show_default="the arm's length",
    ),
]
PICTURE = "File to draw: .png, .pdf, .svg, or interactive .html."
TORSO = ("--torso-height", "--lift")
MEASURE = "inverse-condition-limited-thesis"


@dataclass(frozen=True, kw_only=True)
class GridOptions:
    """Robot, torso height and grid of a map."""

    torso_height: Annotated[
        float | None,
        typer.Option(
            *TORSO, help="Torso height of the map, in metres.",
            show_default="the middle of its range",
        ),
    ] = None  # fmt: skip
    step: Annotated[float, typer.Option(help="Grid step along x, y, z, in metres.")] = 0.05
    yaw_bins: Annotated[
        int,
        typer.Option(
            "--yaw-bins", "--turns", help="Number of base yaws in 360 deg; 16 are 22.5 deg apart."
        ),
    ] = 16
    tool: Annotated[
        str | None,
        typer.Option(
            help="Frame of the robot used as the tool.", show_default="that of the robot file"
        ),
    ] = None

    def grid(self, grasps: str) -> MapGrid:
        """Return the grid with the tilts of named grasps."""
        from tcs.capability import MapGrid

        return MapGrid.of(self.step, self.yaw_bins, grasps)

    def reach(self, robot: str, measure: str = MEASURE, head: str | None = None) -> Reach:
        """Return the reachability of a robot."""
        from tcs.capability import Reach

        return Reach.load(
            robot, tool=self.tool, torso_height=self.torso_height, step=self.step,
            measure=measure, head=head,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ScoreOptions:
    """Robot of a map and scores of its cells."""

    robot: options.Robot = "tiago"
    measure: Annotated[
        str,
        typer.Option(help="Dexterity measure; the default is the manipulability of the thesis."),
    ] = MEASURE
    visibility: Annotated[
        str,
        typer.Option(help="Visibility: corrected, or thesis for the equations as printed."),
    ] = "corrected"
    head: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of the head camera.", show_default="that of the robot"
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class SampleOptions:
    """Samples of a recording that a map uses."""

    height: Annotated[
        float | None,
        typer.Option(
            help="Use only samples with the tool at this height above the floor, to half a step, "
            "in metres."
        ),
    ] = None
    grasps: Annotated[str, typer.Option(help="Tilts of the tool: side, top, side+top or all.")] = (
        "side"
    )
    drop_bad: Annotated[
        bool, typer.Option("--drop-bad", help="Leave out invalid samples instead of stopping.")
    ] = False


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """Files of a map."""

    out: Annotated[Path, typer.Option(help="Map to write.")]
    text: Annotated[
        Path | None,
        typer.Option(
            help="Also write the map as text, with a line score x y z R11 .. R33 for each cell."
        ),
    ] = None

    def check(self, *others: Path | None, inputs: Iterable[Path] = ()) -> None:
        """Check that the files can be written and are no inputs, before the map is made."""
        for path in (self.out, self.text, *others):
            if path is not None:
                check_writable(path, inputs)

    def write(self, capability: CapabilityMap) -> None:
        """Write the map."""
        from tcs.capability import export_text, save_map

        save_map(self.out, capability)
        if self.text is not None:
            export_text(self.text, capability)


def check_picture(path: Path | None) -> None:
    """Check that a picture can be written there, before the result is computed."""
    if path is None:
        return
    if path.suffix != ".html":
        from tcs.output.draw import check_format

        check_format(path)
    check_writable(path)


@dataclass(frozen=True, kw_only=True)
class ErrorOptions:
    """Errors under which base poses are judged."""

    base_error: Annotated[
        float,
        typer.Option(
            help="With --environment: standard deviation of x and y of the base, in metres."
        ),
    ] = 0.0
    base_yaw_error_deg: Annotated[
        float, typer.Option(help="The same of the base's heading, in degrees.")
    ] = 0.0
    task_error: Annotated[
        float, typer.Option(help="The same of x and y of the tool poses, in metres.")
    ] = 0.0
    task_yaw_error_deg: Annotated[
        float, typer.Option(help="The same of a rotation of the tool poses, in degrees.")
    ] = 0.0
    judge: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="With --environment: another base pose in the task frame to judge (m, m, deg).",
            show_default="none",
        ),
    ] = None
    error_samples: Annotated[int, typer.Option(help="Samples of the errors.")] = 300
    error_seed: Annotated[int, typer.Option(help="Seed of these samples.")] = 0

    @property
    def given(self) -> bool:
        """Whether anything is to be judged."""
        errors = (self.base_error, self.base_yaw_error_deg, self.task_error)
        return self.judge is not None or any((*errors, self.task_yaw_error_deg))

    def errors(self) -> PoseErrors:
        """Return the errors.

        Raises:
            TaskError: If one is out of range.
        """
        from tcs.capability import PoseErrors

        return PoseErrors(
            base_position=self.base_error,
            base_yaw=math.radians(self.base_yaw_error_deg),
            task_position=self.task_error,
            task_yaw=math.radians(self.task_yaw_error_deg),
        )

    def judged(self, around: Surroundings, task: GraspTask, best: BasePose) -> list[dict[str, Any]]:
        """Return the success of the best base pose, and of the other one if it is given.

        Args:
            around: The environment.
            task: The task.
            best: The best base pose; the other one has its torso height.

        Raises:
            TcsError: If an option is out of range.
        """
        from tcs.capability import BasePose, success_under_error

        bases = [best]
        if self.judge is not None:
            x, y, yaw_deg = self.judge
            bases.append(BasePose(x, y, math.radians(yaw_deg), best.torso_height, math.nan))
        found = []
        for base in bases:
            pose = base.to_json()
            # Only base poses of the map have a score.
            if math.isnan(pose["score"]):
                del pose["score"]
            success = success_under_error(
                around, task, base, self.errors(), samples=self.error_samples, seed=self.error_seed
            )
            found.append({"base": pose, **success.to_json()})
        return found
