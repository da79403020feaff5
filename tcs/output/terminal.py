"""Terminal output of commands and scripts: notes and progress bars on stderr, exit codes."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tcs.errors import TcsError

interrupted = threading.Event()
"""Set by Ctrl-C: compiled libraries may swallow the exception, or turn it into another."""


def say(text: str) -> None:
    """Print a note that is not part of the result to stderr."""
    sys.stderr.write(f"tcs: {text}\n")
    sys.stderr.flush()


def say_compiling() -> None:
    """Print a note that the kernel is being compiled, which takes a while."""
    say("compiling for this machine, up to a minute; later runs do without.")


def exit_code_of(work: Callable[[], int]) -> int:
    """Run a script's work and return its exit code: 1 or 130, with a note, if it fails."""
    try:
        return work()
    except TcsError as error:
        say(str(error))
    except KeyboardInterrupt:
        say("interrupted; no half-written file is left.")
        return 130
    return 1


@contextmanager
def progress_bar(text: str) -> Iterator[Callable[[int, int], None]]:
    """Provide a function that moves a bar on stderr; without a terminal there is no bar.

    Args:
        text: What is counted.

    Raises:
        KeyboardInterrupt: From the function, after a Ctrl-C that a library swallowed.
    """
    if not sys.stderr.isatty():
        yield _raise_interrupt
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn(text), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=None)

        def advance(done: int, total: int) -> None:
            _raise_interrupt(done, total)
            progress.update(bar, completed=done, total=total)

        yield advance


def _raise_interrupt(_done: int, _total: int) -> None:
    if interrupted.is_set():
        raise KeyboardInterrupt
