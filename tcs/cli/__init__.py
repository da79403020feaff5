"""The command `tcs`: parse, call one library function, print.

In: arguments and options. Out: results on stdout as text or as one JSON object, messages and
progress on stderr, and an exit code.
"""

from __future__ import annotations

import atexit
import errno
import gc
import os
import sys
from contextlib import suppress

from tcs.files.memory import (
    START,
    WANT_OF_MEMORY,
    check_room,
    guard_imports,
    is_for_want_of_memory,
)
from tcs.interrupts import (
    raise_if_interrupted,
    remember_interrupts,
    report_interrupt,
    was_interrupted,
)

COLLECTING = (10_000, 20, 20)
"""Thresholds of `gc.set_threshold`: modules hold hundreds of thousands of objects, which Python, by
its own thresholds, searches for garbage again and again while they are imported."""

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of an output that takes no more."""


def main() -> None:
    """Run the command line.

    An interrupt, or too little memory, ends it in one line even while modules are imported; so does
    an output that cannot be written.
    """
    with suppress(OSError):
        # Where they are closed, what is opened first takes their place.
        sys.stdout = sys.stdout or open(os.devnull, "w")
        sys.stderr = sys.stderr or open(os.devnull, "w")
    fault: OSError | None = None
    try:
        _run()
    except OSError as error:
        if error.filename is not None or error.errno not in _FULL:
            raise
        fault = error
    finally:
        # What was printed may still wait to be written; at its end, Python would write it again.
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError as error:
                fault = fault or error
                with open(os.devnull, "w") as nowhere, suppress(OSError):
                    os.dup2(nowhere.fileno(), stream.fileno())
        if fault is not None:
            with suppress(OSError):
                sys.stderr.write(f"tcs: the output cannot be written: {fault.strerror}.\n")
                sys.stderr.flush()
            sys.exit(1)


def _run() -> None:
    """Run the command line, but for outputs that cannot be written."""
    gc.set_threshold(*COLLECTING)
    # The system takes back what an ended process holds: no search for garbage in all of it.
    atexit.register(gc.freeze)
    with remember_interrupts(to_the_end=True):
        try:
            check_room(START)
            guard_imports()
            # The commands import some hundred modules.
            from tcs.cli.app import app

            raise_if_interrupted()
            app(prog_name="tcs")
        except (Exception, KeyboardInterrupt) as error:
            if is_for_want_of_memory(error):
                sys.exit(f"tcs: {WANT_OF_MEMORY}")
            if not isinstance(error, KeyboardInterrupt) and not was_interrupted():
                raise
            sys.exit(report_interrupt())


__all__ = ["main"]
