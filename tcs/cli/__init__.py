"""The command `tcs`: parse, call one library function, print.

In: arguments and options. Out: results on stdout as text or as one JSON object, messages and
progress on stderr, and an exit code.
"""

from __future__ import annotations

from tcs.cli.app import main

__all__ = ["main"]
