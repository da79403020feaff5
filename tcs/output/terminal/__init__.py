"""Results on a terminal: tables, explanations, messages and progress.

In: results as the plain containers that `--json` prints. Out: compact tables on stdout, one-line
messages and progress bars on stderr.
"""

from __future__ import annotations

from tcs.output.terminal.console import (
    exit_code_of,
    note,
    note_compiling,
    print_result,
    progress_bar,
    results_console,
)

__all__ = [
    "exit_code_of",
    "note",
    "note_compiling",
    "print_result",
    "progress_bar",
    "results_console",
]
