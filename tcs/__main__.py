"""`python -m tcs` is `tcs`."""

from __future__ import annotations

from tcs.cli import main

main()
