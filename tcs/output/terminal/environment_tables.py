"""The check of an environment as text."""

from __future__ import annotations

from typing import Any

import typer


def report_check(found: dict[str, Any]) -> None:
    """Print the result of a check as text."""
    echo = typer.echo
    echo(f"environment      {found['environment']}, {found['shapes']:,} shapes")
    for entry in found["obstacles"]:
        echo(f"obstacle         {_described(entry)}")
    if not found["touching"]:
        echo("touching         no obstacle touches anything")
    for first, second in found["touching"]:
        echo(f"touching         {first} and {second}")
    for heading in ("problems", "notes"):
        for line in found[heading]:
            echo(f"{heading[:-1]:<16} {line}")


def _described(entry: dict[str, Any]) -> str:
    """Return name, type, number and volume of the shapes of an obstacle."""
    count = f"{entry['shapes']:,} shape{'' if entry['shapes'] == 1 else 's'}"
    text = f"{entry['name']}: {entry['type']}, {count}"
    if entry["volume_m3"] is not None:
        text += f" of {entry['volume_m3'] * 1e3:.3g} l together"
    if entry["excess"] is not None and entry["type"] in ("mesh", "cylinder"):
        text += f", {entry['excess']:.2f} times its own volume"
    return text
