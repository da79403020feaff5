"""The command `tcs`: parse, call one library function, print.

In: arguments and options. Out: results on stdout as text or as one JSON object, messages and
progress on stderr, and an exit code.
"""

from __future__ import annotations

import sys

from tcs.interrupts import (
    raise_if_interrupted,
    remember_interrupts,
    report_interrupt,
    was_interrupted,
)


def main() -> None:
    """Run the command line; an interrupt ends it in one line even while modules are imported."""
    with remember_interrupts(to_the_end=True):
        try:
            # The commands import some hundred modules.
            from tcs.cli.app import app

            raise_if_interrupted()
            app(prog_name="tcs")
        except (Exception, KeyboardInterrupt) as error:
            if not isinstance(error, KeyboardInterrupt) and not was_interrupted():
                raise
            sys.exit(report_interrupt())


__all__ = ["main"]
