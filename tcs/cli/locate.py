"""The command `tcs locate`: find a table in scans of a laser scanner, measured or simulated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import perception_tables

if TYPE_CHECKING:
    from tcs.perception import PlanarPose, Scans, TableFile

Pose = tuple[float, float, float]
_METAVAR = "X Y YAW_DEG"


@dataclass(frozen=True, kw_only=True)
class SimulationOptions:
    """A simulated scene and its scans."""

    table_at: Annotated[
        Pose | None,
        typer.Option(
            metavar=_METAVAR,
            help="Simulated: true pose of the table in the environment frame (m, m, deg).",
            show_default="no table",
        ),
    ] = None
    here: Annotated[
        Pose,
        typer.Option(
            metavar=_METAVAR,
            help="Simulated: true base pose in the environment frame (m, m, deg).",
        ),
    ] = (0.0, 0.0, 0.0)
    environment: Annotated[
        str | None,
        typer.Option(
            help="Simulated: name or YAML file of an environment around the table.",
            show_default="nothing",
        ),
    ] = None
    scans: Annotated[int, typer.Option(min=1, max=10_000, help="Simulated: number of scans.")] = 10
    seed: options.Seed = 0

    def simulate(self, table: TableFile) -> Scans:
        """Return simulated scans."""
        from tcs.model.scene import EMPTY_ENVIRONMENT, environment_shapes, load_environment
        from tcs.perception.simulation import simulate, with_table

        around = load_environment(self.environment) if self.environment else EMPTY_ENVIRONMENT
        if self.table_at is not None:
            around = with_table(around, table, pose_of(self.table_at))
        shapes = environment_shapes(around)
        return simulate(shapes, pose_of(self.here), scans=self.scans, seed=self.seed)

    def true_pose(self) -> PlanarPose | None:
        """Return the true pose of the table in the base frame."""
        if self.table_at is None:
            return None
        return pose_of(self.here).inverse() @ pose_of(self.table_at)


@expand_options
def locate(
    simulation: SimulationOptions,
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="SCANS",
            help="CSV file of measured scans: a line per scan with the range of each beam (m), "
            "`inf` without one.",
            show_default="simulated scans",
        ),
    ] = None,
    table: Annotated[str, typer.Option(help="Name or YAML file of a table.")] = "thesis",
    task: Annotated[
        Pose,
        typer.Option(
            metavar=_METAVAR, help="Pose of the task frame in the table's frame (m, m, deg)."
        ),
    ] = (0.0, 0.0, 0.0),
    method: Annotated[
        str,
        typer.Option(
            metavar="legs|two-blobs",
            help="legs: fit all legs in view; two-blobs: the two nearest blobs are the front legs, "
            "as in the ITCM thesis.",
        ),
    ] = "legs",
    expect: Annotated[
        Pose | None,
        typer.Option(
            metavar=_METAVAR,
            help="Rough pose of the table in the base frame (m, m, deg), to choose between poses "
            "that fit equally well.",
            show_default="the front edge nearest to the base",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Also write pose and covariance, for the option --located."),
    ] = None,
    save_scans: Annotated[
        Path | None, typer.Option(help="Simulated: also write the scans to this CSV file.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Find a table by its legs in laser scans: its pose in the base frame, and the covariance."""
    if file is not None and (simulation != SimulationOptions() or save_scans is not None):
        raise typer.BadParameter(
            "measured scans need no simulation; leave out its options.", param_hint="SCANS"
        )
    from tcs.perception import TIAGO, load_table, read_scans, write_scans
    from tcs.perception import locate as locate_table

    for path in (out, save_scans):
        if path is not None:
            check_writable(path, [] if file is None else [file])
    known = load_table(table)
    scans = simulation.simulate(known) if file is None else read_scans(file, TIAGO)
    if save_scans is not None:
        write_scans(save_scans, scans)
    rough = None if expect is None else pose_of(expect)
    step = pose_of(task)
    found = locate_table(scans, known, method=method, expected=rough).shifted(step)
    if out is not None:
        found.save(out)
    result = {"method": method, **found.to_json()}
    true = simulation.true_pose()
    if true is not None:
        result["error"] = found.error(true @ step)
    terminal.print_result(result, perception_tables.report_located, as_json=as_json)


def pose_of(given: Pose) -> PlanarPose:
    """Return a pose given as x, y [m] and heading [deg]."""
    from tcs.errors import PerceptionError
    from tcs.files.quantities import ANGLE_DEG, POSITION
    from tcs.perception import PlanarPose

    x, y, yaw_deg = given
    POSITION.check((x, y), "a pose: a coordinate", PerceptionError)
    ANGLE_DEG.check(yaw_deg, "a pose: the heading", PerceptionError)
    return PlanarPose(x, y, math.radians(yaw_deg))
