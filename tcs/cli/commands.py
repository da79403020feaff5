"""The command group of `tcs`: turns errors and interrupts into one line and an exit code."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from tcs.errors import TcsError
from tcs.output.terminal import console


class Commands(TyperGroup):
    """A command group that ends a failed command with one line and an exit code.

    Exit codes: 0 done, 1 a `TcsError`, 2 misuse (reported by typer), 130 interrupted. Any other
    exception is a defect of the program and keeps its traceback.
    """

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]  # typer's own class
        """Run the command."""
        with console.remember_interrupts():
            try:
                return super().invoke(ctx)
            except TcsError as error:
                console.note(" ".join(str(error).splitlines()))
                raise typer.Exit(1) from None
            except typer.Exit:
                raise
            except (Exception, KeyboardInterrupt) as error:
                if not isinstance(error, KeyboardInterrupt) and not console.was_interrupted():
                    raise
                console.note("interrupted; no half-written file is left.")
                raise typer.Exit(130) from None
