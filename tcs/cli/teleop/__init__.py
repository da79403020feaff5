"""The commands `tcs teleop ...`: teleoperate an arm, play a run back, run the experiment."""

from __future__ import annotations

import typer

from tcs.cli.teleop.driving import live
from tcs.cli.teleop.replaying import replay
from tcs.cli.teleop.trials import experiment

app = typer.Typer()
app.callback(invoke_without_command=True)(live)
app.command()(replay)
app.command()(experiment)

__all__ = ["app"]
