"""The commands `tcs capability ...` and `tcs map-check`: make, merge, draw and check maps."""

from __future__ import annotations

import typer

from tcs.cli.capability.drawing import map_check, show
from tcs.cli.capability.making import from_bag, from_ik, record
from tcs.cli.capability.merging import merge_maps

app = typer.Typer(
    help="Capability maps: the base poses from which an end-effector pose is reached.",
    no_args_is_help=True,
)
app.command("from-ik")(from_ik)
app.command()(record)
app.command("from-bag")(from_bag)
app.command("merge")(merge_maps)
app.command()(show)

__all__ = ["app", "map_check"]
