"""Results on ARPlace models and probability maps: as plain containers, and as text on stdout."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from tcs.output.terminal.perception_tables import report_drive

if TYPE_CHECKING:
    from tcs.capability.arplace import Arplace, ProbabilityMap


def model_result(path: Path, arplace: Arplace) -> dict[str, Any]:
    """Return the summary of a model as plain containers."""
    from tcs.capability.arplace import reconstruction_errors

    errors = reconstruction_errors(arplace)
    model = arplace.success_model
    task = arplace.task
    return {
        "file": str(path),
        "robot": arplace.metadata.get("robot"),
        "grasps": len(task),
        "approach": task.approach,
        "base_positions": task.base_x.count * task.base_y.count,
        "torso_height": arplace.torso_height,
        "base_yaw_deg": task.base_yaw_deg,
        "single_boundaries": int(np.count_nonzero(arplace.simple)),
        "used": int(np.count_nonzero(arplace.used)),
        "representation": arplace.representation,
        "success_model": arplace.rule,
        "modes": model.kept,
        "energy_per_mode": [float(value) for value in model.distribution.energy[: model.kept]],
        "labels": errors.labels,
        "reached": errors.reached,
        "false_inclusions": errors.false_inclusions,
        "false_exclusions": errors.false_exclusions,
    }


def merged_result(found: ProbabilityMap, rule: str, maps: int) -> dict[str, Any]:
    """Return the summary of a probability map as plain containers."""
    from tcs.capability.arplace.query import best_to_json

    i, j = found.best()
    return {
        "rule": rule,
        "maps": maps,
        "best": best_to_json(found, float(found.x[i]), float(found.y[j])),
        "success": float(found.probability[i, j]),
    }


def report_learned(result: dict[str, Any]) -> None:
    """Print the summary of a model that was learned."""
    typer.echo(f"wrote {result['file']} in {result['seconds']:.1f} s")
    report_model(result)


def report_model(result: dict[str, Any]) -> None:
    """Print the summary of a model."""
    echo = typer.echo
    echo(
        f"{result['robot']}, {result['approach']} grasps: {result['grasps']} grasps from "
        f"{result['base_positions']:,} base positions, torso height {result['torso_height']:.3f} "
        f"m, yaw {result['base_yaw_deg']:g} deg"
    )
    echo(
        f"{result['single_boundaries']} of {result['grasps']} regions have a single boundary; "
        f"{result['used']} are represented by {result['representation']}"
    )
    energy = ", ".join(f"{100.0 * value:.1f}" for value in result["energy_per_mode"])
    echo(f"{result['success_model']} success model, {result['modes']} modes, energy [%]: {energy}")
    echo(
        f"of {result['labels']:,} labels {result['reached']:,} are reached; the model includes "
        f"{result['false_inclusions']:,} falsely and excludes {result['false_exclusions']:,} "
        "falsely"
    )


def report_query(result: dict[str, Any]) -> None:
    """Print the best base position of a query."""
    low, high = result["success_ci95"]
    typer.echo(f"best {_base_pose(result['best'])}")
    typer.echo(f"success {result['success']:.3f} ({low:.3f} .. {high:.3f}, 95 % interval)")
    if result["outside"]:
        typer.echo(
            f"{100.0 * result['outside']:.1f} % of the samples are outside the learned parameters "
            "and count as failures"
        )
    report_drive(result)
    typer.echo(f"{result['samples']:,} samples in {1e3 * result['seconds']:.1f} ms")


def report_merged(result: dict[str, Any]) -> None:
    """Print the best base position of a map."""
    typer.echo(f"best {_base_pose(result['best'])}")
    typer.echo(f"success {result['success']:.3f}")


def _base_pose(base: dict[str, float]) -> str:
    return (
        f"x {base['x']:.3f} m, y {base['y']:.3f} m, yaw {base['yaw_deg']:g} deg, torso height "
        f"{base['torso_height']:.3f} m"
    )
