"""The commands `tcs map`, a picture from above, and `tcs picture`, a picture in space."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.output import terminal

if TYPE_CHECKING:
    # Quick commands such as `tcs list` must not load matplotlib.
    from matplotlib.figure import Figure

    from tcs.output.report.score.shown_set import ShownSet
    from tcs.placement.store import ScoreFile

SCORES = ("reachability", "manipulability")

_Out = Annotated[Path, typer.Option(help="Picture to write: .png, .pdf or .svg.")]


@expand_options
def draw_map(
    file: options.File,
    out: _Out,
    chosen: options.ShownOptions,
    states: Annotated[
        bool,
        typer.Option(
            "--states",
            help="Draw one map for each state of the environment, e.g. bed height by head rest.",
        ),
    ] = False,
    score: Annotated[
        str | None,
        typer.Option(
            metavar="reachability|manipulability",
            help="With --states: the score that colours the base positions.",
            show_default="reachability",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Draw the best score at each base position, from above, and the members of a set.

    The picture shows the set selected from --here, or the recommended one.
    """
    if score is not None and not states:
        raise typer.BadParameter(
            "requires --states; without it both scores are drawn.", param_hint="--score"
        )
    if score not in (None, *SCORES):
        raise typer.BadParameter(f"must be one of {', '.join(SCORES)}.", param_hint="--score")

    def of_states(loaded: ScoreFile, shown: ShownSet) -> Figure:
        from tcs.output.report.score.states import states_figure

        by_manipulability = score == "manipulability"
        return states_figure(
            loaded, shown, "manipulability" if by_manipulability else "reachability"
        )

    drawn = _draw(of_states, file, out, chosen) if states else map_from_above(file, out, chosen)
    _print(drawn, as_json=as_json)


@expand_options
def draw_picture(
    file: options.File,
    out: _Out,
    chosen: options.ShownOptions,
    as_json: options.Json = False,
) -> None:
    """Draw the robot at the base poses of a set, its arm at a goal, as collision shapes.

    The picture shows the set selected from --here, or the recommended one.
    """
    _print(picture(file, out, chosen), as_json=as_json)


def map_from_above(file: Path, out: Path, chosen: options.ShownOptions) -> dict[str, Any]:
    """Draw both scores at each base position and the members of a set."""

    def figure(loaded: ScoreFile, shown: ShownSet) -> Figure:
        from tcs.output.report.score.pictures import map_figure

        return map_figure(loaded, shown)

    return _draw(figure, file, out, chosen)


def picture(file: Path, out: Path, chosen: options.ShownOptions) -> dict[str, Any]:
    """Draw the robot at the base poses of a set."""

    def figure(loaded: ScoreFile, shown: ShownSet) -> Figure:
        from tcs.output.report.score.pictures import scene_figure

        return scene_figure(loaded, shown)

    return _draw(figure, file, out, chosen)


def _draw(
    figure: Callable[[ScoreFile, ShownSet], Figure],
    file: Path,
    out: Path,
    chosen: options.ShownOptions,
) -> dict[str, Any]:
    """Draw the set selected from the current state, or the best set; return what was written."""
    import tcs
    from tcs.files.writing import check_writable
    from tcs.output.draw import check_format, save_figure

    here = chosen.state()
    check_format(out)
    check_writable(out)
    loaded = tcs.load(file)

    from tcs.output.report.score.shown_set import ShownSet

    observed = chosen.observation(loaded.observed_axes)
    shown = ShownSet.of(loaded, here, chosen.max_members, observed, refined=chosen.refined)
    save_figure(out, figure(loaded, shown))
    return {"file": str(out), "members": [member.to_json() for member in shown.members]}


def _print(result: dict[str, Any], *, as_json: bool) -> None:
    """Print the file that was written."""
    wrote = f"wrote {result['file']}"
    terminal.print_result(result, lambda _: typer.echo(wrote), as_json=as_json)
