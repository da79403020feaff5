"""What the commands on capability maps tell a person."""

from __future__ import annotations

from typing import Any

import typer


def report_map(result: dict[str, Any]) -> None:
    """Print for a person what map was made."""
    echo = typer.echo
    echo(
        f"wrote {result['file']}: {result['kind']} of {result['robot']}, "
        f"{result['cells']:,} cells, lift {result['lift']:.4f} m"
    )
    if "seconds" in result:
        echo(f"{result['cells_asked']:,} cells solved in {result['seconds']:.1f} s")
    if "discretisation_error" in result:
        echo(
            f"{result['samples']:,} samples; left out: {result['dropped']:,} unusable, "
            f"{result['off_height']:,} off the height, {result['off_grid']:,} off the grid's tilts"
        )
        echo("from the recorded to the grid's pose, mean (std)")
        for axis, error in result["discretisation_error"].items():
            unit = "m" if axis in "xyz" else "rad"
            echo(f"  {axis:<6} {error['mean']:.4f} ({error['std']:.4f}) {unit}")


def report_merged(result: dict[str, Any]) -> None:
    """Print for a person where to stand."""
    typer.echo(f"{result['map']}, {result['task']}: {result['base_poses']:,} base poses")
    for name in ("best", "worst"):
        typer.echo(f"{name:<6} {_shown(result[name])}")
    if "left" in result:
        typer.echo(f"left   {_shown(result['left'])}; the room takes {result['taken']} better ones")
    off, turn = result["off_cell_m"], result["off_cell_rad"]
    if off or turn:
        typer.echo(f"tool poses are off the grid by up to {off:.4f} m, {turn:.4f} rad")


def report_stops(result: dict[str, Any]) -> None:
    """Print for a person where to stand one after the other."""
    for stop in result["stops"]:
        first, last = stop["positions"][0], stop["positions"][-1]
        typer.echo(f"positions {first} to {last}: {_shown(stop)}")


def report_check(result: dict[str, Any]) -> None:
    """Print for a person how often a map is right."""
    shown = result["map"] or "a map that holds all cells"
    typer.echo(
        f"{shown}: {result['step']:g} m, {360 / result['turns']:g} deg, beside inverse kinematics"
    )
    names = ("reachable", "accuracy", "false_positives", "false_negatives", "recall", "precision")
    typer.echo("grasps  queries  " + "  ".join(f"{name:>15}" for name in names))
    for grasps, row in result["grasps"].items():
        shares = "  ".join(f"{100 * row[name]:>13.2f} %" for name in names)
        typer.echo(f"{grasps:<6} {row['queries']:>8,}  {shares}")


def _shown(base: dict[str, Any]) -> str:
    return (
        f"x {base['x']:.2f} m, y {base['y']:.2f} m, yaw {base['yaw_deg']:g} deg, "
        f"lift {base['lift']:.3f} m, score {base['score']:.3f}"
    )
