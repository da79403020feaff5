"""The commands `tcs select` and `tcs explain`, which read a score file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options, robustness
from tcs.cli.options import expand_options
from tcs.output import terminal
from tcs.output.terminal import tables

if TYPE_CHECKING:
    from tcs.kernel.arrays import FloatArray
    from tcs.placement.reasons import Explanation
    from tcs.placement.selection import UtilityWeights
    from tcs.placement.store import ScoreFile


@dataclass(frozen=True, kw_only=True)
class _ChangeCosts(options.TravelCosts):
    """Costs of changes of the configuration, with the defaults of `fix_weights`."""

    turn_weight: options.TurnWeight = 0.3
    torso_weight: options.TorsoWeight = 1.0
    axis_weight: Annotated[list[str] | None, options.axis_weight("2 per metre, 1 per radian")] = (
        None
    )
    travel: options.Travel = "around"


@dataclass(frozen=True, kw_only=True)
class _StartOptions:
    """The current base pose, known or relative to a table that was found."""

    here: Annotated[tuple[float, float, float] | None, options.HERE] = None
    located: Annotated[Path | None, options.LOCATED] = None
    task_at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="With --located, in place of --here: pose in the environment frame of the frame "
            "that was located (m, m, deg).",
        ),
    ] = None

    def base(self) -> tuple[tuple[float, float, float] | None, FloatArray | None]:
        """Return the base pose in m, m and deg, and its covariance in m and rad if it was located.

        The base pose is None if it is not known.

        Raises:
            typer.BadParameter: If the options do not determine it.
            DataFileError: If the file cannot be used.
        """
        if self.here is not None and self.located is not None:
            raise typer.BadParameter("give --here or --located, not both.", param_hint="--here")
        if self.located is None:
            if self.task_at is not None:
                raise typer.BadParameter("requires --located.", param_hint="--task-at")
            return self.here, None
        if self.task_at is None:
            raise typer.BadParameter("requires --task-at.", param_hint="--located")
        from tcs.cli.locate import pose_of
        from tcs.perception import load_located

        base, covariance = load_located(self.located).base_in(pose_of(self.task_at))
        return (base.x, base.y, math.degrees(base.yaw)), covariance


@expand_options
def select(
    file: options.File,
    *,
    start: _StartOptions,
    torso: options.Torso = 0.0,
    at: options.At = None,
    alpha: Annotated[
        float | None, typer.Option(help="Weight of the goals reached, P_R.", show_default="1")
    ] = None,
    beta: Annotated[
        float | None, typer.Option(help="Weight of the manipulability, P_M.", show_default="1")
    ] = None,
    gamma: Annotated[
        float | None, typer.Option(help="Weight of the travel cost.", show_default="0.05")
    ] = None,
    delta: robustness.Delta = None,
    costs: options.TravelCosts,
    wanted: options.ConstraintOptions,
    offered: options.TopOptions,
    max_members: options.Members = None,
    observed: options.Observed = None,
    frames: Annotated[
        list[str] | None,
        options.frames(
            "Observed position of a body frame in the environment frame (m), in place of "
            "--observed."
        ),
    ] = None,
    executable: Annotated[
        bool,
        typer.Option(
            "--executable",
            help="Count only goals to which `tcs motions` found a motion, and choose among the "
            "configurations that it examined.",
        ),
    ] = False,
    parking: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,YAW_DEG",
            help="By how much the robot may be off at every stop (m, m, deg): select only sets "
            "that still do what they do then; 0,0,0 only says how far it may be off. Windows that "
            "FILE lacks are found by scoring base poses around the stops, and kept in it.",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Select the recommended set; with weights, that of the greatest utility from --here.

    Recommended is the most robust set where `tcs robustify` estimated the success under error; else
    the set of the greatest utility; and without --here, the one that reaches most goals with the
    fewest stops. Each weight or penalty that is given makes the utility decide.
    """
    import tcs
    from tcs.cli.values import current_state, frame_values, observed_settings, parking_window
    from tcs.output.words import choice_in_words
    from tcs.placement.constraints import scored_entries
    from tcs.placement.parking import find_windows
    from tcs.placement.selection import Executability, same_set
    from tcs.placement.store import motions_of

    base, covariance = start.base()
    if base is None and (torso or at):
        raise typer.BadParameter("--torso and --at require --here.", param_hint="--here")
    loaded = tcs.load(file)
    here = None if base is None else current_state(base, torso, at or ())
    choose = partial(
        tcs.select,
        loaded,
        weights=_weights(
            reachability=alpha,
            manipulability=beta,
            travel=gamma,
            success=delta,
            places=offered.place_penalty,
            environment=offered.environment_penalty,
            preference=offered.preference_penalty,
        ),
        travel=costs.weights(),
        constraints=wanted.constraints(),
        top=offered.sets(),
        max_members=max_members,
        observed=observed_settings(observed or (), loaded.observed_axes),
        frames=frame_values(frames or ()),
        parking=parking_window(parking),
        find_windows=partial(find_windows, on_compile=terminal.note_compiling),
    )
    motions = motions_of(loaded, file) if executable else None
    try:
        choice = choose(here, motions=motions)
    finally:
        _keep_windows(file, loaded)
    for warning in choice.warnings:
        terminal.note(warning)
    result = choice_in_words(loaded, choice, here)
    if motions is not None:
        compared = Executability.of(loaded, motions, choice, choose(here))
        result["executable"] = compared.to_json(choice)
    if covariance is not None and base is not None and here is not None:
        x, y, yaw_deg = base
        result["located"] = {
            "here": {"x": x, "y": y, "yaw_deg": yaw_deg},
            "covariance": covariance.tolist(),
            "same_set": same_set(partial(choose, motions=motions), here, covariance),
        }
    result |= scored_entries(loaded)
    terminal.print_result(result, tables.report_choice, as_json=as_json)


def _keep_windows(path: Path, file: ScoreFile) -> None:
    """Keep the windows that were found in the score file; without leave to write, say so."""
    if all(table.known_windows is table.windows for table in file.tables):
        return
    import tcs
    from tcs.errors import OutputError
    from tcs.placement.parking import with_windows

    try:
        tcs.save(path, with_windows(file))
    except OutputError as error:
        terminal.note(f"The windows that were found are not kept: {error}")


def _weights(**given: float | None) -> UtilityWeights | None:
    """Return the weights that were given, the others at their defaults; None without any.

    Raises:
        SelectionError: If a weight is out of range.
    """
    from tcs.placement.selection import UtilityWeights

    stated = {name: value for name, value in given.items() if value is not None}
    return UtilityWeights(**stated) if stated else None


@expand_options
def explain(
    file: options.File,
    *,
    goal: Annotated[
        str | None,
        typer.Option(
            help="Name of the goal, or its number, from 1.", show_default="all goals, a line each"
        ),
    ] = None,
    configuration: Annotated[
        int | None,
        typer.Option(
            help="Number of a configuration, as in `tcs export`.",
            show_default="the best member of the recommended set",
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
    arm: Annotated[
        str | None,
        typer.Option(
            help="Arm to explain, in a file of both arms.",
            show_default="the one that reaches the goal, or comes nearest to it",
        ),
    ] = None,
    costs: _ChangeCosts,
    observed: options.Observed = None,
    frames: Annotated[
        list[str] | None,
        options.frames(
            "Observed position of a body frame in the environment frame (m), in place of "
            "--observed."
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Explain why a goal is not reached, and find the cheapest change that reaches it."""
    if configuration is not None and here is not None:
        raise typer.BadParameter("give --configuration or --here, not both.", param_hint="--here")
    if here is None and (at or torso):
        raise typer.BadParameter("--torso and --at require --here.", param_hint="--here")

    import tcs
    from tcs.cli.values import current_state, frame_values, observed_settings
    from tcs.model.grid import Grid
    from tcs.output.terminal.explanations import report_explanation, report_explanations
    from tcs.output.words import explanation_in_words, goal_index_of_number
    from tcs.placement.reasons import fix_weights

    loaded = tcs.load(file)
    explained = partial(
        tcs.explain,
        loaded,
        configuration=configuration if here is None else current_state(here, torso, at or ()),
        weights=fix_weights(
            Grid.from_dict(loaded.grid),
            metre=costs.metre_weight,
            turn=costs.turn_weight,
            torso=costs.torso_weight,
            environment=costs.axes,
            route=costs.travel,
        ),
        observed=observed_settings(observed or (), loaded.observed_axes),
        frames=frame_values(frames or ()),
    )
    if goal is None:
        if arm is not None:
            raise typer.BadParameter("requires --goal.", param_hint="--arm")
        every = [
            explanation_in_words(loaded, explained(number))
            for number in range(loaded.nominal.sets.weights.size)
        ]
        terminal.print_result({"goals": every}, report_explanations, as_json=as_json)
        return
    explanation = explained(goal_index_of_number(loaded, goal))
    if arm is not None:
        from tcs.placement.refinement.by_arm import explained_by_arm

        explanation = explained_by_arm(explanation, arm)
    result = explanation_in_words(loaded, explanation)
    if not explanation.distribution.reached:
        result["missing"] = _missing(loaded, explanation)
    terminal.print_result(result, report_explanation, as_json=as_json)


def _missing(file: ScoreFile, explanation: Explanation) -> list[dict[str, Any]] | None:
    """Return what would make a goal reached that nothing reaches; None where the models changed."""
    from tcs.errors import TcsError
    from tcs.placement.refinement.missing import what_is_missing

    try:
        found = what_is_missing(
            file, explanation.goal, explanation.match.index, on_compile=terminal.note_compiling
        )
    except TcsError as error:
        terminal.note(f"what is missing cannot be computed: {error}")
        return None
    return [remedy.to_json() for remedy in found]
