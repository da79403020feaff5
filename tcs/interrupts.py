"""Ctrl-C, SIGTERM and a closed terminal: one line, a clean end, and an exit code.

This module is imported before everything else, so that an interrupt finds its handler however early
it comes. It imports nothing large.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

_ENDINGS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
if hasattr(signal, "SIGHUP"):
    # The terminal was closed; under `nohup` the signal is ignored, and stays so.
    _ENDINGS[signal.SIGHUP] = "hung up"
_received: list[int] = []
"""The signals received: compiled libraries may drop the exception, or replace it by another one."""
_reported: list[int] = []
"""The exit code that `report_interrupt` returned last, if it did."""
_LATER = 0.05
"""Time after which a signal is sent again that came while a compiled module was loaded [s]."""
_LOADER = ("create_module", "<frozen importlib._bootstrap_external>")
"""Function and file of the frame in which Python loads a compiled module."""


@contextmanager
def remember_interrupts(*, to_the_end: bool = False) -> Iterator[None]:
    """Record Ctrl-C, SIGTERM and SIGHUP, in addition to raising `KeyboardInterrupt`.

    Inside another `remember_interrupts`, and on other than the main thread, it does nothing.

    Args:
        to_the_end: Whether the process ends afterwards. A later signal then ends it at once: while
            Python shuts down, an exception could only print a traceback.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # A handler that the calling program has set stays in force; so does ours, further out.
    before = {
        number: signal.getsignal(number)
        for number in _ENDINGS
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL)
    }
    if not before:
        yield
        return
    _received.clear()
    _reported.clear()
    if to_the_end:
        # The first one to be registered is the last one to be called.
        atexit.register(_exit_as_reported)
    report_unraisable = sys.unraisablehook

    def report_other(unraisable: sys.UnraisableHookArgs) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            report_unraisable(unraisable)

    # Python cannot raise through a callback of compiled code, such as llvmlite's: it would print
    # the interrupt and continue. The list records it.
    sys.unraisablehook = report_other
    for number in before:
        signal.signal(number, _remember)
    try:
        yield
    finally:
        sys.unraisablehook = report_unraisable
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if to_the_end else handler)


def _remember(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    while frame is not None:
        if (frame.f_code.co_name, frame.f_code.co_filename) == _LOADER:
            # Drake, for one, logs an exception that is raised in the initialisation of its modules.
            again = threading.Timer(_LATER, signal.raise_signal, (number,))
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


def _exit_as_reported() -> None:
    """End an interrupted process with the exit code that `report_interrupt` returned.

    Where compiled code ran the Python code that the interrupt ended, Python notes an unhandled
    interrupt, even if it is handled further out, and `python -m` would end with the signal instead.
    """
    if _reported:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_reported[0])


def was_interrupted() -> bool:
    """Return whether one of the signals came inside `remember_interrupts`."""
    return bool(_received)


def raise_if_interrupted() -> None:
    """Raise the `KeyboardInterrupt` of an earlier signal that compiled code dropped."""
    if _received:
        raise KeyboardInterrupt


def report_interrupt() -> int:
    """Print in one line that the work was interrupted; return the exit code: 130, 143 or 129."""
    number = _received[0] if _received else signal.SIGINT
    line = f"tcs: {_ENDINGS[signal.Signals(number)]}; no half-written file is left.\n"
    # A closed terminal takes no line.
    with suppress(OSError):
        sys.stderr.write(line)
        sys.stderr.flush()
    _reported[:] = [128 + number]
    return 128 + number
