"""The commands `tcs arplace learn`, `query`, `merge` and `show`."""

from __future__ import annotations

import typer

from tcs.cli.arplace.drawing import merge, show
from tcs.cli.arplace.models import learn, query

app = typer.Typer(
    help="ARPlace: probability of a grasp over base positions, learned for varying parameters.",
    no_args_is_help=True,
)
app.command()(learn)
app.command()(query)
app.command()(merge)
app.command()(show)

__all__ = ["app"]
