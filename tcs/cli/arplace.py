"""The commands `tcs arplace learn`, `query`, `merge` and `show`."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.errors import SelectionError
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import arplace_tables

if TYPE_CHECKING:
    from tcs.capability.arplace import (
        Arplace,
        FloorObstacle,
        ModelOptions,
        ObjectPose,
        ProbabilityMap,
        TableTask,
    )
    from tcs.kernel.arrays import FloatArray
    from tcs.model.grid import Axis

app = typer.Typer(
    help="ARPlace: probability of a grasp over base positions, learned for varying parameters.",
    no_args_is_help=True,
)

Model = Annotated[Path, typer.Argument(metavar="FILE", help="A model made by `tcs arplace learn`.")]
Values = tuple[float, float, int]
PICTURE = "Picture to write: .png, .pdf or .svg."
FIGURES = ("modes", "reconstruction", "generalisation")


def _values(what: str, unit: str = "in metres") -> typer.models.OptionInfo:
    """Return an option for equally spaced values."""
    option: typer.models.OptionInfo = typer.Option(
        metavar="FIRST STEP COUNT", help=f"{what}, {unit}."
    )
    return option


@dataclass(frozen=True, kw_only=True)
class TaskOptions:
    """Grasps on a table and base positions."""

    distances: Annotated[Values, _values("Distances of the tool from the table's edge")] = (
        *(0.0, 0.05), 10,
    )  # fmt: skip
    heights: Annotated[Values, _values("Heights of the tool above the floor")] = (0.415, 0.1, 4)
    angles_deg: Annotated[Values, _values("Grasp angles", "in degrees")] = (0.0, 0.0, 1)
    approach: Annotated[str, typer.Option(help="Grasp from the top or from the side.")] = "top"
    base_x: Annotated[Values, _values("Base positions; the table's edge is at 0")] = (
        *(-1.2, 0.05), 25,
    )  # fmt: skip
    base_y: Annotated[Values, _values("Base positions along the edge; the object is at 0")] = (
        *(-1.2, 0.05), 49,
    )  # fmt: skip
    base_yaw_deg: Annotated[
        float, typer.Option(help="Heading of the base, in degrees; 0 faces the table.")
    ] = 0.0
    torso_height: Annotated[
        float | None,
        typer.Option(help="Torso height, in metres.", show_default="the middle of its range"),
    ] = None
    below_tool: Annotated[
        float, typer.Option(help="Distance from the tool down to the table, in metres.")
    ] = 0.045
    thickness: Annotated[
        float | None,
        typer.Option(
            help="Thickness of the table top, in metres.", show_default="solid down to the floor"
        ),
    ] = None
    depth: Annotated[float, typer.Option(help="Depth of the table, in metres.")] = 1.2

    def task(self) -> TableTask:
        """Return the task.

        Raises:
            GridError: If a value is invalid.
        """
        from tcs.capability.arplace import TableTask

        return TableTask(
            distance=_axis("distance", "m", self.distances),
            height=_axis("height", "m", self.heights),
            angle=_axis("angle", "deg", self.angles_deg),
            approach=self.approach,
            base_x=_axis("base_x", "m", self.base_x),
            base_y=_axis("base_y", "m", self.base_y),
            base_yaw_deg=self.base_yaw_deg,
            torso_height=self.torso_height,
            below_tool=self.below_tool,
            thickness=self.thickness,
            depth=self.depth,
        )


@dataclass(frozen=True, kw_only=True)
class GeneralisationOptions:
    """How labels are generalised."""

    representation: Annotated[
        str,
        typer.Option(
            help="Landmarks by-shape or equidistant, signed-distance, or automatic: landmarks if "
            "every region has a single boundary."
        ),
    ] = "automatic"
    success_model: Annotated[
        str,
        typer.Option(
            help="linear, quadratic, interpolated, or automatic: quadratic for landmarks, "
            "interpolated for signed distances."
        ),
    ] = "automatic"
    energy: Annotated[
        float | None,
        typer.Option(
            help="Fraction of the variance that the deformation modes hold.",
            show_default="0.99 for landmarks, 0.999 for signed distances",
        ),
    ] = None
    scale: Annotated[
        float, typer.Option(help="Kernel scale of the support vector machine, in metres.")
    ] = 0.15
    box: Annotated[
        float, typer.Option(help="Box constraint of the support vector machine.")
    ] = 1e6  # fmt: skip

    def options(self) -> ModelOptions:
        """Return the options of the library.

        Raises:
            TcsError: If a value is invalid.
        """
        from tcs.capability.arplace import Classifier, ModelOptions

        return ModelOptions(
            representation=self.representation,
            rule=self.success_model,
            energy=self.energy,
            classifier=Classifier(self.scale, self.box),
        )


@dataclass(frozen=True, kw_only=True)
class PoseOptions:
    """Pose of the object and its error."""

    std: Annotated[
        float, typer.Option(help="Standard deviation of the object's x and y, in metres.")
    ] = 0.0
    std_z: Annotated[
        float, typer.Option(help="Standard deviation of its height, in metres.")
    ] = 0.0  # fmt: skip
    std_angle_deg: Annotated[
        float, typer.Option(help="Standard deviation of the grasp angle, in degrees.")
    ] = 0.0
    covariance: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="XX XY YY",
            help="Covariance of x and y in square metres, in place of --std.",
            show_default="none",
        ),
    ] = None
    distance: Annotated[
        float | None,
        typer.Option(
            help="Distance of the object from the table's edge, in metres.",
            show_default="the middle of the learned ones",
        ),
    ] = None
    height: Annotated[
        float | None,
        typer.Option(
            help="Height of the tool above the floor, in metres.",
            show_default="the middle of the learned ones",
        ),
    ] = None
    angle_deg: Annotated[
        float | None,
        typer.Option(
            help="Grasp angle, in degrees.", show_default="the middle of the learned ones"
        ),
    ] = None
    y: Annotated[
        float, typer.Option(help="Position of the object along the table's edge, in metres.")
    ] = 0.0

    def pose(self, arplace: Arplace) -> ObjectPose:
        """Return the pose of the object."""
        from tcs.capability.arplace import ObjectPose

        middle = ObjectPose.middle_of(arplace)
        return ObjectPose(
            distance=middle.distance if self.distance is None else self.distance,
            height=middle.height if self.height is None else self.height,
            angle=middle.angle if self.angle_deg is None else math.radians(self.angle_deg),
            y=self.y,
        )

    def error(self) -> FloatArray:
        """Return the covariance of the pose.

        Raises:
            SelectionError: If a value is invalid.
            typer.BadParameter: If both --std and --covariance are given.
        """
        from tcs.capability.arplace import covariance_of

        if self.covariance is not None and self.std:
            raise typer.BadParameter("replaces --std; give one of them.", param_hint="--covariance")
        std = (self.std, self.std, self.std_z, math.radians(self.std_angle_deg))
        return covariance_of(std, self.covariance)


@expand_options
def learn(
    out: Annotated[Path, typer.Option(help="Model to write.")],
    task: TaskOptions,
    generalisation: GeneralisationOptions,
    robot: options.Robot = "tiago",
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Learn from which base positions grasps on a table are reached.

    The kernel labels every base position for every grasp; contacts with the table count. The
    defaults are the task of Appendix D of the ITCM thesis.
    """
    from tcs.capability.arplace import learn as learn_arplace
    from tcs.capability.arplace import save_arplace

    check_writable(out)
    begun = time.perf_counter()
    with terminal.progress_bar("labels") as on_progress:
        arplace = learn_arplace(
            robot, task.task(), generalisation.options(), jobs=jobs, on_progress=on_progress
        )
    seconds = time.perf_counter() - begun
    save_arplace(out, arplace)
    result = {**arplace_tables.model_result(out, arplace), "seconds": round(seconds, 3)}
    terminal.print_result(result, arplace_tables.report_learned, as_json=as_json)


@expand_options
def query(
    model: Model,
    pose: PoseOptions,
    obstacle: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,SIZE_X,SIZE_Y[,YAW_DEG]",
            help="A rectangle on the floor (m, deg); may be repeated.",
        ),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(
            help="Least distance of the base's centre from obstacles, in metres.",
            show_default="the radius of the base",
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Random poses of the object.")] = 1000,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Also write the map, for `tcs arplace merge`.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Return the base position of the greatest probability of success under pose errors."""
    from tcs.capability.arplace import load_arplace, save_probability_map
    from tcs.capability.arplace import query as query_arplace

    if clearance is not None and not obstacle:
        raise typer.BadParameter("requires --obstacle.", param_hint="--clearance")
    _check_outputs(out, picture)
    obstacles = [obstacle_of(text) for text in obstacle or ()]
    arplace = load_arplace(model)
    # The first query prepares what all queries of a model share.
    at = pose.pose(arplace)
    _ = arplace.window
    found = query_arplace(
        arplace, at, pose.error(), obstacles=obstacles, clearance=clearance, samples=samples,
        seed=seed,
    )  # fmt: skip
    if out is not None:
        save_probability_map(out, found.map)
    if picture is not None:
        _draw_map(picture, found.map, (found.x, found.y), f"success {found.success:.3f}")
    result = {"file": str(model), **found.to_json()}
    terminal.print_result(result, arplace_tables.report_query, as_json=as_json)


def merge(
    maps: Annotated[
        list[Path], typer.Argument(metavar="MAP...", help="Maps made by `tcs arplace query --out`.")
    ],
    rule: Annotated[
        str,
        typer.Option(
            metavar="max|product",
            help="max: several grasps of one object; product: several objects.",
        ),
    ] = "max",
    out: Annotated[Path | None, typer.Option(help="Also write the merged map.")] = None,
    picture: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Merge probability maps of the same base positions."""
    from tcs.capability.arplace import load_probability_map, merge_maps, save_probability_map

    _check_outputs(out, picture)
    merged = merge_maps([load_probability_map(path) for path in maps], rule)
    i, j = merged.best()
    best = (float(merged.x[i]), float(merged.y[j]))
    if out is not None:
        save_probability_map(out, merged)
    if picture is not None:
        _draw_map(picture, merged, best, f"{rule} of {len(maps)} maps")
    result = arplace_tables.merged_result(merged, rule, len(maps))
    terminal.print_result(result, arplace_tables.report_merged, as_json=as_json)


def show(
    model: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A model or a probability map."),
    ],
    out: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    figure: Annotated[
        str | None,
        typer.Option(
            metavar="modes|reconstruction|generalisation",
            help="With --out, picture of a model: deformation modes and their energy, errors of "
            "the reconstruction, or boundaries by degree and energy.",
            show_default="modes",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Print a summary of a model or a map, and draw it."""
    from tcs.capability.arplace import load_arplace, load_probability_map
    from tcs.capability.arplace.files import is_probability_map

    if figure is not None and out is None:
        raise typer.BadParameter("requires --out.", param_hint="--figure")
    if figure not in (None, *FIGURES):
        raise typer.BadParameter(f"must be one of {', '.join(FIGURES)}.", param_hint="--figure")
    _check_outputs(None, out)
    if is_probability_map(model):
        found = load_probability_map(model)
        if figure is not None:
            raise typer.BadParameter("a map has a single figure.", param_hint="--figure")
        i, j = found.best()
        if out is not None:
            _draw_map(out, found, (float(found.x[i]), float(found.y[j])), "")
        result = arplace_tables.merged_result(found, "none", 1)
        terminal.print_result(result, arplace_tables.report_merged, as_json=as_json)
        return
    arplace = load_arplace(model)
    if out is not None:
        from tcs.output.draw import save_figure
        from tcs.output.draw.arplace import figure_of

        save_figure(out, figure_of(arplace, figure or FIGURES[0]))
    result = arplace_tables.model_result(model, arplace)
    terminal.print_result(result, arplace_tables.report_model, as_json=as_json)


def obstacle_of(text: str) -> FloorObstacle:
    """Return an obstacle given as "X,Y,SIZE_X,SIZE_Y[,YAW_DEG]" [m, deg].

    Raises:
        SelectionError: If the text is not of that form, or a value is out of range.
    """
    from tcs.capability.arplace import FloorObstacle

    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (4, 5):
        raise SelectionError(
            f"--obstacle is '{text[:80]}'; must be X,Y,SIZE_X,SIZE_Y or X,Y,SIZE_X,SIZE_Y,YAW_DEG."
        )
    return FloorObstacle(*numbers[:4], *map(math.radians, numbers[4:]))


def _axis(name: str, unit: str, values: Values) -> Axis:
    from tcs.model.grid import Axis

    return Axis(name, unit, *values)


def _check_outputs(out: Path | None, picture: Path | None) -> None:
    """Check that files can be written, before the result is computed."""
    if picture is not None:
        from tcs.output.draw import check_format

        check_format(picture)
    for path in (out, picture):
        if path is not None:
            check_writable(path)


def _draw_map(
    path: Path, found: ProbabilityMap, best: tuple[float, float], caption: str
) -> None:  # fmt: skip
    from tcs.output.draw import save_figure
    from tcs.output.draw.arplace import map_figure

    save_figure(path, map_figure(found, best, caption))


app.command()(learn)
app.command()(query)
app.command()(merge)
app.command()(show)
