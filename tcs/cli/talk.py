"""How commands talk: results to stdout, everything else to stderr, a bar only on a terminal."""

from __future__ import annotations

import json
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import typer
from rich.console import Console
from typer.core import TyperGroup

from tcs.errors import TcsError
from tcs.output.terminal import interrupted, progress_bar, say, say_compiling

__all__ = [
    "Commands",
    "paper",
    "print_result",
    "progress_bar",
    "say",
    "say_compiling",
]

_PIPE_WIDTH = 110
"""Columns where nobody says how wide the paper is: no row of ours is wider."""


class Commands(TyperGroup):
    """Commands that end in one line and an exit code when something goes wrong.

    0 done, 1 our error, 2 misuse (told by typer), 130 interrupted. Whatever else is raised is a
    mistake of ours, and keeps its traceback.
    """

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]  # typer's own class
        """Run the command that was asked for."""
        with _remembering_interrupts():
            try:
                return super().invoke(ctx)
            except TcsError as error:
                say(" ".join(str(error).splitlines()))
                raise typer.Exit(1) from None
            except typer.Exit:
                raise
            except (Exception, KeyboardInterrupt) as error:
                if not isinstance(error, KeyboardInterrupt) and not interrupted.is_set():
                    raise
                say("interrupted; no half-written file is left.")
                raise typer.Exit(130) from None


@contextmanager
def _remembering_interrupts() -> Iterator[None]:
    """Remember Ctrl-C besides raising `KeyboardInterrupt`."""

    def remember(_number: int, _frame: FrameType | None) -> None:
        interrupted.set()
        raise KeyboardInterrupt

    interrupted.clear()
    in_charge = threading.current_thread() is threading.main_thread()
    # Somebody who has set another handler, or ignores the signal, wants it so.
    if not in_charge or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    report_unraisable = sys.unraisablehook

    def report_other(unraisable: sys.UnraisableHookArgs) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            report_unraisable(unraisable)

    signal.signal(signal.SIGINT, remember)
    # Python cannot raise through a callback of compiled code, such as llvmlite's: it would print
    # the interrupt and carry on. The event has it.
    sys.unraisablehook = report_other
    try:
        yield
    finally:
        sys.unraisablehook = report_unraisable
        signal.signal(signal.SIGINT, signal.default_int_handler)


def print_result(
    result: dict[str, Any], report: Callable[[dict[str, Any]], None], *, as_json: bool
) -> None:
    """Print a result, as one JSON object or for a person.

    Args:
        result: Plain containers.
        report: Prints it for a person.
        as_json: Whether one JSON object is asked for.
    """
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    else:
        report(result)


def paper(pipe_width: int = _PIPE_WIDTH) -> Console:
    """Return where results for a person go; `pipe_width` columns wide where it is no terminal."""
    width = None if sys.stdout.isatty() else pipe_width
    return Console(width=width, highlight=False, markup=False)
