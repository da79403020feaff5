"""The command `tcs`: parse, call one library function, print."""

from __future__ import annotations

from tcs.cli.app import main

__all__ = ["main"]
