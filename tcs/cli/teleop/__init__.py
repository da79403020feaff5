"""The commands `tcs teleop ...`: teleoperate an arm, play a run back, run the experiments."""

from __future__ import annotations

from collections.abc import Callable

import typer

from tcs.cli.teleop.driving import live
from tcs.cli.teleop.replaying import replay, work
from tcs.cli.teleop.trials import experiment, pick_and_place

EXPERIMENTS: dict[str, Callable[..., None]] = {
    "experiment": experiment,
    "pick-and-place": pick_and_place,
}
"""Experiments with scripted operators, by name."""

app = typer.Typer()
app.callback(invoke_without_command=True)(live)
app.command()(replay)
for _name, _command in EXPERIMENTS.items():
    app.command(_name)(_command)
app.command()(work)

__all__ = ["EXPERIMENTS", "app"]
