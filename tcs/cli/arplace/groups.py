"""Groups of options of `tcs arplace`: task, generalisation, pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from tcs.capability.arplace import Arplace, ModelOptions, ObjectPose, TableTask
    from tcs.kernel.arrays import FloatArray
    from tcs.model.grid import Axis

Values = tuple[float, float, int]


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


def _axis(name: str, unit: str, values: Values) -> Axis:
    from tcs.model.grid import Axis

    return Axis(name, unit, *values)
