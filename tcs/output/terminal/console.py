"""The terminal: results on stdout, messages and progress on stderr."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console

from tcs.errors import TcsError
from tcs.files.plain import without_infinities
from tcs.interrupts import raise_if_interrupted, remember_interrupts, report_interrupt

_PIPE_WIDTH = 110
"""Width where stdout is not a terminal, in columns; no row of our tables is wider."""


LINE_SECONDS = 10.0
"""Least time between two lines of progress [s]."""


def note(text: str) -> None:
    """Print one line that is not a result, to stderr."""
    typer.echo(f"tcs: {text}", err=True)


def exit_code_of(work: Callable[[], int]) -> int:
    """Run a script; return its exit code: 1 after a `TcsError`, 130 or 143 interrupted."""
    with remember_interrupts():
        try:
            return work()
        except TcsError as error:
            note(str(error))
            return 1
        except KeyboardInterrupt:
            return report_interrupt()


def note_compiling() -> None:
    """Print why the first run takes longer."""
    note("compiling for this machine, up to a minute; later runs use the compiled code.")


def print_result(
    result: dict[str, Any], report: Callable[[dict[str, Any]], None], *, as_json: bool
) -> None:
    """Print a result as one JSON object or as text.

    Args:
        result: Plain containers.
        report: Prints the result as text.
        as_json: Whether to print one JSON object; infinities and NaN are null in it.
    """
    if as_json:
        typer.echo(json.dumps(without_infinities(result), indent=2, allow_nan=False))
    else:
        report(result)


def results_console(pipe_width: int = _PIPE_WIDTH) -> Console:
    """Return the console for results, `pipe_width` columns wide where stdout is no terminal."""
    width = None if sys.stdout.isatty() else pipe_width
    return Console(width=width, highlight=False, markup=False)


@contextmanager
def progress_bar(text: str, *, lines: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that updates a progress bar on stderr; without a terminal there is no bar.

    Args:
        text: Label of the bar.
        lines: Whether to print a line now and then where there is no terminal.

    Raises:
        KeyboardInterrupt: From the function, after an interrupt that compiled code dropped.
    """
    if not sys.stderr.isatty():
        yield _lines(text) if lines else _no_bar
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        *(TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()),
        *(TextColumn("left"), TimeRemainingColumn()),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=None)

        def advance(done: int, total: int) -> None:
            raise_if_interrupted()
            progress.update(bar, completed=done, total=total)

        yield advance


def _lines(text: str) -> Callable[[int, int], None]:
    """Return a function that prints progress at most once in LINE_SECONDS."""
    begun = printed = time.monotonic()

    def advance(done: int, total: int) -> None:
        nonlocal printed
        raise_if_interrupted()
        if (now := time.monotonic()) - printed >= LINE_SECONDS:
            printed = now
            left = f", about {(total - done) * (now - begun) / done:.0f} s left" if done else ""
            note(f"{done} of {total} {text}{left}")

    return advance


def _no_bar(_done: int, _total: int) -> None:
    raise_if_interrupted()
