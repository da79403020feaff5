"""Results on tables found by a laser scanner, as text on stdout."""

from __future__ import annotations

from typing import Any

import typer


def report_located(result: dict[str, Any]) -> None:
    """Print the pose of a table, its error and the legs."""
    echo = typer.echo
    std = result["std"]
    echo(
        f"table '{result['table']}' in the base frame: {pose_text(result['pose'])} (standard "
        f"deviations {1e3 * std['x']:.1f} mm, {1e3 * std['y']:.1f} mm, {std['yaw_deg']:.2f} deg)"
    )
    legs = ", ".join(
        f"{leg['name']} {leg['beams']} beams" if leg["beams"] else f"{leg['name']} not seen"
        for leg in result["legs"]
    )
    echo(f"{result['scans']} scans, {result['blobs']} blobs; legs: {legs}")
    for pose in result["alternatives"]:
        echo(f"fits equally well: {pose_text(pose)}; choose with --expect")
    if "error" in result:
        error = result["error"]
        echo(
            f"error {1e3 * error['position']:.1f} mm, {error['yaw_deg']:.2f} deg; Mahalanobis "
            f"distance {error['mahalanobis']:.1f}"
        )


def report_drive(result: dict[str, Any]) -> None:
    """Print the motion of the base to a pose relative to a located table, if there is one."""
    if "drive_to" in result:
        typer.echo(f"drive to {pose_text(result['drive_to'])}, from the present base pose")


def pose_text(pose: dict[str, float]) -> str:
    """Return a pose on the floor as text."""
    return f"x {pose['x']:.3f} m, y {pose['y']:.3f} m, yaw {pose['yaw_deg']:.2f} deg"
