"""The terminal: results on stdout, messages and progress on stderr, and a record of Ctrl-C."""

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

from tcs.errors import TcsError

_PIPE_WIDTH = 110
"""Width where stdout is not a terminal, in columns; no row of our tables is wider."""


_interrupted = threading.Event()
"""Set by Ctrl-C: compiled libraries may drop the exception, or replace it by another one."""


@contextmanager
def remember_interrupts() -> Iterator[None]:
    """Record Ctrl-C in addition to raising `KeyboardInterrupt`."""

    def remember(_number: int, _frame: FrameType | None) -> None:
        _interrupted.set()
        raise KeyboardInterrupt

    _interrupted.clear()
    on_main_thread = threading.current_thread() is threading.main_thread()
    # A handler that the calling program has set stays in force.
    if not on_main_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    report_unraisable = sys.unraisablehook

    def report_other(unraisable: sys.UnraisableHookArgs) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            report_unraisable(unraisable)

    signal.signal(signal.SIGINT, remember)
    # Python cannot raise through a callback of compiled code, such as llvmlite's: it would print
    # the interrupt and continue. The event records it.
    sys.unraisablehook = report_other
    try:
        yield
    finally:
        sys.unraisablehook = report_unraisable
        signal.signal(signal.SIGINT, signal.default_int_handler)


def was_interrupted() -> bool:
    """Return whether Ctrl-C was pressed inside `remember_interrupts`."""
    return _interrupted.is_set()


def note(text: str) -> None:
    """Print one line that is not a result, to stderr."""
    typer.echo(f"tcs: {text}", err=True)


def exit_code_of(work: Callable[[], int]) -> int:
    """Run a script; return its exit code: 1 after a `TcsError`, 130 after Ctrl-C."""
    try:
        return work()
    except TcsError as error:
        note(str(error))
    except KeyboardInterrupt:
        note("interrupted; no half-written file is left.")
        return 130
    return 1


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
        as_json: Whether to print one JSON object.
    """
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    else:
        report(result)


def results_console(pipe_width: int = _PIPE_WIDTH) -> Console:
    """Return the console for results, `pipe_width` columns wide where stdout is no terminal."""
    width = None if sys.stdout.isatty() else pipe_width
    return Console(width=width, highlight=False, markup=False)


@contextmanager
def progress_bar(text: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a function that updates a progress bar on stderr; without a terminal there is no bar.

    Args:
        text: Label of the bar.

    Raises:
        KeyboardInterrupt: From the function, after a Ctrl-C that compiled code dropped.
    """
    if not sys.stderr.isatty():
        yield _raise_interrupt
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=None)

        def advance(done: int, total: int) -> None:
            _raise_interrupt(done, total)
            progress.update(bar, completed=done, total=total)

        yield advance


def _raise_interrupt(_done: int, _total: int) -> None:
    if _interrupted.is_set():
        raise KeyboardInterrupt
