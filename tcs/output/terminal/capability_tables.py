"""Results on capability maps: as plain containers, and as text on stdout."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tcs.output.terminal.perception_tables import report_drive

if TYPE_CHECKING:
    from tcs.capability import CapabilityMap, MapCheck, MapGrid, TaskMap


def map_result(path: Path, capability: CapabilityMap) -> dict[str, Any]:
    """Return the summary of a map as plain containers."""
    return {
        "file": str(path),
        "map_type": capability.map_type,
        "robot": capability.metadata["robot"],
        "cells": len(capability.cells),
        "cells_considered": capability.metadata.get("cells_considered"),
        "torso_height": capability.torso_height,
        "manipulability_scale": capability.manipulability_scale,
    }


def task_map_result(task_map: TaskMap, seconds: float) -> dict[str, Any]:
    """Return the summary of a task map, merged in some seconds, as plain containers."""
    return {
        "map": task_map.name,
        "task": task_map.task.name,
        "positions": [[p.x, p.y, p.height] for p in task_map.task.positions],
        "base_poses": len(task_map.base_poses),
        "best": task_map.best().to_json(),
        "worst": task_map.worst().to_json(),
        "position_offset": task_map.nearness.offset,
        "angle_offset": task_map.nearness.angle,
        "seconds": seconds,
    }


def check_result(
    path: Path | None, grid: MapGrid, checks: Mapping[str, MapCheck]
) -> dict[str, Any]:
    """Return the accuracy of a map by set of grasps as plain containers."""
    return {
        "map": None if path is None else str(path),
        "step": grid.step,
        "yaw_bins": grid.yaw_bins,
        "grasps": {name: check.to_json() for name, check in checks.items()},
    }


def report_map(result: dict[str, Any]) -> None:
    """Print the summary of a map."""
    echo = typer.echo
    echo(
        f"wrote {result['file']}: {result['map_type']} of {result['robot']}, "
        f"{result['cells']:,} cells, torso height {result['torso_height']:.4f} m"
    )
    if "seconds" in result:
        echo(f"{result['cells_considered']:,} cells solved in {result['seconds']:.1f} s")
    if "discretisation_error" in result:
        echo(
            f"{result['samples']:,} samples; left out: {result['dropped']:,} invalid, "
            f"{result['wrong_height']:,} at another height, {result['wrong_tilt']:,} at a tilt not "
            "in the grid"
        )
        echo("discretisation error, mean (standard deviation)")
        for axis, error in result["discretisation_error"].items():
            unit = "m" if axis in "xyz" else "rad"
            echo(f"  {axis:<6} {error['mean']:.4f} ({error['std']:.4f}) {unit}")


def report_merged(result: dict[str, Any]) -> None:
    """Print the base poses of a task map."""
    typer.echo(f"{result['map']}, {result['task']}: {result['base_poses']:,} base poses")
    for name in ("best", "worst"):
        typer.echo(f"{name:<6} {_base_pose(result[name])}")
    if "best_in_environment" in result:
        typer.echo(
            f"best in the environment {_base_pose(result['best_in_environment'])}; "
            f"{result['rejected']} better ones are infeasible there"
        )
    for one in result.get("success", ()):
        low, high = one["complete_ci95"]
        base = one["base"]
        typer.echo(
            f"base x {base['x']:.2f} m, y {base['y']:.2f} m, yaw {base['yaw_deg']:.1f} deg under "
            f"error: the whole task in {one['complete']:.1%} of {one['samples']} samples (95 % "
            f"between {low:.1%} and {high:.1%}), {one['positions']:.1%} of the positions"
        )
    if "best_under_error" in result:
        best = result["best_under_error"]
        typer.echo(
            f"best under the error of the located task {_base_pose(best)}; expected score "
            f"{best['expected_score']:.3f}, feasible with probability {best['feasible']:.3f}"
        )
    report_drive(result)
    offset, angle = result["position_offset"], result["angle_offset"]
    if offset or angle:
        typer.echo(f"tool poses differ from grid cells by up to {offset:.4f} m, {angle:.4f} rad")


def report_stops(result: dict[str, Any]) -> None:
    """Print a sequence of base poses."""
    for stop in result["stops"]:
        first, last = stop["positions"][0], stop["positions"][-1]
        typer.echo(f"positions {first} to {last}: {_base_pose(stop)}")


def report_check(result: dict[str, Any]) -> None:
    """Print the accuracy of a map."""
    name = result["map"] or "a map of all cells"
    typer.echo(
        f"{name}: {result['step']:g} m, {360 / result['yaw_bins']:g} deg, compared with inverse "
        "kinematics"
    )
    names = ("reachable", "accuracy", "false_positives", "false_negatives", "recall", "precision")
    typer.echo("grasps  queries  " + "  ".join(f"{name:>15}" for name in names))
    for grasps, row in result["grasps"].items():
        percentages = "  ".join(f"{100 * row[name]:>13.2f} %" for name in names)
        typer.echo(f"{grasps:<6} {row['queries']:>8,}  {percentages}")


def _base_pose(base: dict[str, Any]) -> str:
    return (
        f"x {base['x']:.2f} m, y {base['y']:.2f} m, yaw {base['yaw_deg']:g} deg, "
        f"torso height {base['torso_height']:.3f} m, score {base['score']:.3f}"
    )
