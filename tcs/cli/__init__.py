"""The command `tcs`: parse, call one library function, print.

In: arguments and options. Out: results on stdout as text or as one JSON object, messages and
progress on stderr, and an exit code.
"""

from __future__ import annotations

import atexit
import gc
import sys

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


def main() -> None:
    """Run the command line.

    An interrupt, or too little memory, ends it in one line even while modules are imported.
    """
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
