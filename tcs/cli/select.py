"""The commands `tcs select` and `tcs explain`, which only read a score file."""

from __future__ import annotations

from typing import Annotated

import typer

from tcs.cli import options, robustness
from tcs.output import terminal
from tcs.output.terminal import tables


def select(
    file: options.File,
    here: Annotated[tuple[float, float, float], options.HERE],
    torso: options.Torso = 0.0,
    at: options.At = None,
    alpha: Annotated[float, typer.Option(help="Weight of the goals reached, P_R.")] = 1.0,
    beta: Annotated[float, typer.Option(help="Weight of the manipulability, P_M.")] = 1.0,
    gamma: Annotated[float, typer.Option(help="Weight of the travel cost.")] = 0.05,
    delta: robustness.Delta = 0.0,
    metre_weight: Annotated[float, typer.Option(help="Cost of a metre of driving.")] = 1.0,
    turn_weight: Annotated[float, typer.Option(help="Cost of a radian of base rotation.")] = 0.0,
    torso_weight: Annotated[float, typer.Option(help="Cost of a metre of torso motion.")] = 0.0,
    axis_weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=COST",
            help="Cost of a metre or radian along an axis of the environment.",
        ),
    ] = None,
    travel: Annotated[
        str,
        typer.Option(help="Path of the base: straight, as in the paper, or around the furniture."),
    ] = "straight",
    max_members: options.Members = None,
    observed: options.Observed = None,
    frames: Annotated[
        list[str] | None,
        typer.Option(
            "--frames",
            "--seen",
            metavar="FRAME=X,Y,Z",
            help="Observed position of a body frame in the environment frame (m), in place of "
            "--observed.",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Select the set with the greatest utility from the current state."""
    import tcs
    from tcs.cli.values import axis_values, current_state, frame_values, observed_settings

    loaded = tcs.load(file)
    choice = tcs.select(
        loaded,
        current_state(here, torso, at or ()),
        weights=tcs.UtilityWeights(
            reachability=alpha, manipulability=beta, travel=gamma, success=delta
        ),
        travel=tcs.TravelWeights(
            metre=metre_weight,
            turn=turn_weight,
            torso=torso_weight,
            environment=axis_values(axis_weight or (), "--axis-weight"),
            route=travel,
        ),
        max_members=max_members,
        observed=observed_settings(observed or (), loaded.observed_axes),
        frames=frame_values(frames or ()),
    )
    result = choice.to_json(loaded.metadata["measure"])
    terminal.print_result(result, tables.report_choice, as_json=as_json)


def explain(
    file: options.File,
    goal: Annotated[int, typer.Option(help="Number of the goal, from 0.", show_default=False)],
    configuration: Annotated[
        int | None,
        typer.Option(
            help="Number of a configuration, as in `tcs export`.",
            show_default="the best member of the best set",
        ),
    ] = None,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Base pose to explain instead, in the environment frame (m, m, deg), with --torso "
            "and --at.",
        ),
    ] = None,
    torso: options.Torso = 0.0,
    at: options.At = None,
    metre_weight: Annotated[float, typer.Option(help="Cost of a metre of driving.")] = 1.0,
    turn_weight: Annotated[float, typer.Option(help="Cost of a radian of base rotation.")] = 0.3,
    torso_weight: Annotated[float, typer.Option(help="Cost of a metre of torso motion.")] = 1.0,
    axis_weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=COST",
            help="Cost of a metre (default 2) or radian (default 1) along an axis of the "
            "environment.",
        ),
    ] = None,
    travel: Annotated[
        str,
        typer.Option(metavar="straight|around", help="Path of the base."),
    ] = "around",
    observed: options.Observed = None,
    as_json: options.Json = False,
) -> None:
    """Explain why a goal is not reached, and find the cheapest change that reaches it."""
    if configuration is not None and here is not None:
        raise typer.BadParameter("give --configuration or --here, not both.", param_hint="--here")
    if here is None and (at or torso):
        raise typer.BadParameter("--torso and --at need --here.", param_hint="--here")

    import tcs
    from tcs.cli.values import axis_values, current_state, observed_settings
    from tcs.model.grid import Grid
    from tcs.output.terminal.explanations import report_explanation
    from tcs.placement.reasons import fix_weights

    loaded = tcs.load(file)
    explanation = tcs.explain(
        loaded,
        goal,
        current_state(here, torso, at or ()) if here is not None else configuration,
        weights=fix_weights(
            Grid.from_dict(loaded.grid),
            metre=metre_weight,
            turn=turn_weight,
            torso=torso_weight,
            environment=axis_values(axis_weight or (), "--axis-weight"),
            route=travel,
        ),
        observed=observed_settings(observed or (), loaded.observed_axes),
    )
    result = {**explanation.to_json(), "measure": loaded.metadata["measure"]}
    terminal.print_result(result, report_explanation, as_json=as_json)
