"""The commands `tcs teleop ...`: teleoperate an arm, play a run back, run the experiments."""

from __future__ import annotations

import typer

from tcs.cli.teleop.driving import live
from tcs.cli.teleop.replaying import replay, work
from tcs.cli.teleop.trials import experiment, pick_and_place

app = typer.Typer()
app.callback(invoke_without_command=True)(live)
app.command()(replay)
app.command()(experiment)
app.command("pick-and-place")(pick_and_place)
app.command()(work)

__all__ = ["app"]
