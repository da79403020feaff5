"""Arguments and options that several commands share, alone and as groups."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_type_hints

import typer

from tcs.cli.values import axis_values, observed_settings, state_if_given
from tcs.files.quantities import DURATION, JOBS, QUERIES

if TYPE_CHECKING:
    from tcs.files.blocks import BlockFolder
    from tcs.model.grid import Axis, InitialConfiguration
    from tcs.placement.constraints import Constraints
    from tcs.placement.selection import Top, TravelWeights

R = TypeVar("R")


def expand_options(command: Callable[..., R]) -> Callable[..., R]:
    """Return a command for typer, with the fields of its dataclass parameters as options.

    A parameter annotated with a dataclass is replaced by the fields of the dataclass, and the
    command is called with an instance of it.

    Args:
        command: A function whose parameters are those of a typer command, or dataclasses.
    """
    groups: dict[str, type] = {}
    parameters: list[inspect.Parameter] = []
    hints = get_type_hints(command, include_extras=True)
    for name, parameter in inspect.signature(command).parameters.items():
        hint = hints[name]
        if not (isinstance(hint, type) and is_dataclass(hint)):
            parameters.append(parameter.replace(kind=parameter.KEYWORD_ONLY, annotation=hint))
            continue
        groups[name] = hint
        field_hints = get_type_hints(hint, include_extras=True)
        for field in fields(hint):
            default = parameter.empty if field.default is MISSING else field.default
            parameters.append(
                inspect.Parameter(
                    field.name,
                    parameter.KEYWORD_ONLY,
                    default=default,
                    annotation=field_hints[field.name],
                )
            )

    @wraps(command)
    def expanded(**values: Any) -> R:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        return command(**values)

    expanded.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    expanded.__annotations__ = {p.name: p.annotation for p in parameters}
    return expanded


File = Annotated[Path, typer.Argument(metavar="FILE", help="A file made by `tcs score`.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Robot = Annotated[str, typer.Option(help="Name or YAML file of a robot.")]
Jobs = Annotated[
    int,
    typer.Option(
        min=int(JOBS.low),
        max=int(JOBS.high),
        help="Number of threads; does not change the results.",
    ),
]
MOST_QUERIES = int(QUERIES.high)
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
HERE = typer.Option(
    "--here",
    metavar="X Y YAW_DEG",
    help="Current base pose in the environment frame (m, m, deg).",
)
LOCATED = typer.Option(
    metavar="FILE", help="Pose of a table and its covariance, made by `tcs locate --out`."
)
Torso = Annotated[float, typer.Option(help="Current torso height, in metres.")]
At = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="Current setting of an axis of the environment, in metres; AXIS_deg=VALUE for angles.",
    ),
]
Observed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="Observed state of the person, e.g. person_y=0.03 (m; AXIS_deg=VALUE for angles); "
        "the nearest scored state is used.",
    ),
]
Members = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=3,
        help="Greatest number of base poses in the set: 1, 2 or 3.",
        show_default="that of the file",
    ),
]
Only = Annotated[
    list[str] | None,
    typer.Option(
        metavar="CONDITION",
        help="Condition on an axis of the grid: 'head_rest >= 35 deg', 'bed_height = 20 cm', "
        "'base_x = -1..0.5 m'.",
    ),
]
Person = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FILE|KEY=VALUE",
        help="Whose body and posture the person has: sex=female or male, any of stature, mass and "
        "other measures of docs/people.md (m, kg), or NAME_percentile=P; age=YEARS, posture=NAME, "
        "JOINT_deg=ANGLE, JOINT_mobility=FRACTION; or a YAML file of these.",
        show_default="that of the environment file",
    ),
]
MetreWeight = Annotated[float, typer.Option(help="Cost of a metre of driving.")]
TurnWeight = Annotated[float, typer.Option(help="Cost of a radian of base rotation.")]
TorsoWeight = Annotated[float, typer.Option(help="Cost of a metre of torso motion.")]
Travel = Annotated[
    str,
    typer.Option(
        metavar="straight|around",
        help="Path of the base: straight, as in the paper, or around the furniture.",
    ),
]


Blocks = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Keep finished blocks of the work in this folder: after an interrupt or a crash the "
        "same command continues there.",
    ),
]
Restart = Annotated[
    bool, typer.Option("--restart", help="With --blocks: discard what was finished before.")
]


def block_folder(blocks: Path | None, restart: bool) -> BlockFolder | None:
    """Return the folder of `--blocks` and `--restart`, None without one.

    Raises:
        typer.BadParameter: If there is nothing to restart.
    """
    from tcs.files.blocks import BlockFolder

    if restart and blocks is None:
        raise typer.BadParameter("requires --blocks.", param_hint="--restart")
    return None if blocks is None else BlockFolder(blocks, restart)


def axis_weight(default: str) -> typer.models.OptionInfo:
    """Return the option `--axis-weight` with a text for its default."""
    option: typer.models.OptionInfo = typer.Option(
        metavar="AXIS=COST",
        help="Cost of a metre or radian along an axis of the environment.",
        show_default=default,
    )
    return option


def frames(use: str) -> typer.models.OptionInfo:
    """Return the option `--frames` with a help text."""
    option: typer.models.OptionInfo = typer.Option(
        "--frames", "--seen", metavar="FRAME=X,Y,Z", help=use
    )
    return option


@dataclass(frozen=True, kw_only=True)
class TravelCosts:
    """Costs of travel."""

    metre_weight: MetreWeight = 1.0
    turn_weight: TurnWeight = 0.0
    torso_weight: TorsoWeight = 0.0
    axis_weight: Annotated[list[str] | None, axis_weight("0")] = None
    travel: Travel = "straight"

    @property
    def axes(self) -> tuple[tuple[str, float], ...]:
        """Cost along each axis of the environment that was given.

        Raises:
            SelectionError: If one is not of the form AXIS=COST.
        """
        return axis_values(self.axis_weight or (), "--axis-weight")

    def weights(self) -> TravelWeights:
        """Return the weights of the travel cost.

        Raises:
            SelectionError: If a weight is invalid.
        """
        from tcs.placement.selection import TravelWeights

        return TravelWeights(
            metre=self.metre_weight,
            turn=self.turn_weight,
            torso=self.torso_weight,
            environment=self.axes,
            route=self.travel,
        )


@dataclass(frozen=True, kw_only=True)
class ScoringConstraintOptions:
    """Constraints on what may be scored or selected."""

    only: Only = None
    keep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS", help="Axis that stays as it is now, e.g. bed_height (see --at)."
        ),
    ] = None

    forbid: Annotated[
        list[str] | None,
        typer.Option(
            metavar="REGION",
            help="Polygon on which the robot must not stand: 'X1 Y1, X2 Y2, X3 Y3, ...' in the "
            "environment frame (m), or a YAML file with the key polygon.",
        ),
    ] = None
    blocked: Annotated[
        list[str] | None,
        typer.Option(
            metavar="BOX",
            help="Further obstacle, which neither body nor arm may touch: 'X Y WIDTH DEPTH "
            "[YAW_DEG] [Z_LOW Z_HIGH]' in the environment frame (m, deg), or a polygon 'X1 Y1, "
            "X2 Y2, X3 Y3, ... [; Z_LOW Z_HIGH]'.",
        ),
    ] = None

    constraints_file: Annotated[
        Path | None,
        typer.Option(
            "--constraints",
            metavar="FILE",
            help="YAML file with lists under only, keep, forbid, blocked and prefer, besides those "
            "of the command line.",
        ),
    ] = None

    def constraints(self) -> Constraints:
        """Return the constraints of the file and of the command line.

        Raises:
            TcsError: If one is not of its form.
        """
        from tcs.placement.constraints import (
            Constraints,
            Obstacle,
            Region,
            merged,
            read_constraints,
        )

        regions = []
        for given in self.forbid or ():
            is_file = Path(given).suffix in (".yaml", ".yml")
            regions.append(Region.read(Path(given)) if is_file else Region.parse(given))
        given_here = Constraints(
            only=tuple(self.only or ()),
            keep=tuple(self.keep or ()),
            forbid=tuple(regions),
            blocked=tuple(Obstacle.parse(given) for given in self.blocked or ()),
        )
        if self.constraints_file is None:
            return given_here
        return merged(read_constraints(self.constraints_file), given_here)


@dataclass(frozen=True, kw_only=True)
class ConstraintOptions(ScoringConstraintOptions):
    """Constraints on what may be selected, and preferences."""

    prefer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SIDE|CONDITION",
            help="Preferred side of the person, left, right, head or foot, or a condition as of "
            "--only; see --preference-penalty.",
        ),
    ] = None

    def constraints(self) -> Constraints:
        """Return the constraints and preferences of the file and of the command line.

        Raises:
            TcsError: If one is not of its form.
        """
        from tcs.placement.constraints import Constraints, merged

        return merged(super().constraints(), Constraints(prefer=tuple(self.prefer or ())))


@dataclass(frozen=True, kw_only=True)
class TopOptions:
    """Alternatives to the best set, and the penalties that order the sets."""

    top: Annotated[
        int | None,
        typer.Option(min=1, max=100, help="Number of sets to offer.", show_default="1"),
    ] = None
    min_apart: Annotated[
        float,
        typer.Option(
            help="Distance in metres at which base positions count as different, with --top."
        ),
    ] = 0.5
    place_penalty: Annotated[
        float | None,
        typer.Option(
            help="Fraction of the score that each further base pose costs.", show_default="0.01"
        ),
    ] = None
    environment_penalty: Annotated[
        float | None,
        typer.Option(
            help="What moving the environment from its setting (--at) costs.", show_default="0.01"
        ),
    ] = None
    preference_penalty: Annotated[
        float | None,
        typer.Option(
            help="What a set costs that violates a preference (--prefer).", show_default="0.05"
        ),
    ] = None

    def sets(self) -> Top | None:
        """Return the number of sets and their differences; None for the best set alone.

        Raises:
            SelectionError: If a number is out of range.
        """
        from tcs.placement.selection import Top

        return None if self.top is None else Top(count=self.top, min_apart=self.min_apart)


@dataclass(frozen=True, kw_only=True)
class ShownOptions:
    """The set that a picture, a report or a view shows."""

    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Show the set selected from this base pose in the environment frame (m, m, deg).",
            show_default="the recommended set, wherever the robot is",
        ),
    ] = None
    torso: Torso = 0.0
    max_members: Members = None
    observed: Observed = None
    refined: Annotated[
        bool,
        typer.Option(help="Whether a refined set is shown, in a file that `tcs refine` refined."),
    ] = True

    def state(self) -> InitialConfiguration | None:
        """Return the current state, or None without `--here`.

        Raises:
            typer.BadParameter: If there is a torso height without `--here`.
        """
        return state_if_given(self.here, self.torso)

    def observation(self, axes: Sequence[Axis]) -> dict[str, float]:
        """Return the observed state [m or rad].

        Args:
            axes: The observed axes of the score file.

        Raises:
            SelectionError: If a value is not of the form AXIS=VALUE.
        """
        return observed_settings(self.observed or (), axes)


@dataclass(frozen=True, kw_only=True)
class CheckOptions:
    """How many pairs are verified."""

    pairs: Annotated[
        int, typer.Option(min=0, max=MOST_QUERIES, help="Reached pairs to re-check with Drake.")
    ] = 500
    dense: Annotated[
        int,
        typer.Option(min=0, max=MOST_QUERIES, help="Unreached and reached pairs to scan densely."),
    ] = 200
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class WindowOptions:
    """A page in the browser."""

    port: Annotated[
        int | None,
        typer.Option(
            min=1024,
            max=65535,
            help="Port of the page, on this machine; its address is printed.",
            show_default="a free one",
        ),
    ] = None
    browser: Annotated[bool, typer.Option(help="Whether to open a browser.")] = True
    duration: Annotated[
        float | None,
        typer.Option(
            min=DURATION.low,
            max=DURATION.high,
            help="Close after this many seconds.",
            show_default="at Ctrl-C",
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class ExportOptions:
    """A self-contained page in place of a viewer."""

    export: Annotated[
        Path | None,
        typer.Option(
            metavar="PAGE",
            help="Write one self-contained .html page with the animation, and exit.",
        ),
    ] = None
    meshes: Annotated[
        bool,
        typer.Option(
            "--meshes",
            help="With --export: show the robot's meshes in place of its collision shapes; the "
            "output states their licence.",
        ),
    ] = False
    as_json: Annotated[
        bool, typer.Option("--json", help="With --export: print one JSON object.")
    ] = False

    def check(self) -> None:
        """Check the options, and that the page can be written.

        Raises:
            typer.BadParameter: If `--meshes` or `--json` is given without `--export`.
            OutputError: If the page cannot be written, or its name does not end in .html.
        """
        if self.export is None:
            if self.meshes or self.as_json:
                raise typer.BadParameter(
                    "--meshes and --json require --export.", param_hint="--export"
                )
            return
        from tcs.files.writing import check_page

        check_page(self.export)
