"""The command group of `tcs`: turns errors and interrupts into one line and an exit code."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

from tcs.errors import TcsError
from tcs.files.memory import WANT_OF_MEMORY, is_for_want_of_memory
from tcs.interrupts import remember_interrupts, report_interrupt, was_interrupted
from tcs.output.terminal import console


class Commands(TyperGroup):
    """A command group that ends a failed command with one line and an exit code.

    Exit codes: 0 done, 1 a `TcsError` or too little memory, 2 misuse (reported by typer), 130
    interrupted by Ctrl-C, 143
    terminated by SIGTERM. Any other exception is a defect of the program and keeps its traceback.
    """

    def make_context(
        self, info_name: str | None, args: list[str], *arguments: Any, **options: Any
    ) -> Any:
        """Parse the command line."""
        with _ended_in_one_line():
            _refuse_empty(args)
            return super().make_context(info_name, args, *arguments, **options)

    def invoke(self, ctx: typer.Context) -> Any:  # type: ignore[override]  # typer's own class
        """Run the command."""
        with _ended_in_one_line():
            return super().invoke(ctx)


def _refuse_empty(words: list[str]) -> None:
    """Refuse empty texts on the command line, such as an unset variable of a shell script.

    As a path, an empty text would be the current folder, and as a name the default.

    Raises:
        typer.BadParameter: If a word, or the value of an option, is empty.
    """
    for before, word in zip(["", *words], words, strict=False):
        if word.startswith("--") and word.endswith("="):
            raise typer.BadParameter("is empty.", param_hint=word[:-1])
        if not word and before.startswith("-"):
            raise typer.BadParameter("is empty.", param_hint=before)
        if not word:
            raise typer.BadParameter("an argument is empty.")


@contextmanager
def _ended_in_one_line() -> Iterator[None]:
    with remember_interrupts():
        try:
            yield
        except TcsError as error:
            console.note(" ".join(str(error).splitlines()))
            raise typer.Exit(1) from None
        except typer.Exit:
            raise
        except (Exception, KeyboardInterrupt) as error:
            if is_for_want_of_memory(error):
                console.note(WANT_OF_MEMORY)
                raise typer.Exit(1) from None
            if not isinstance(error, KeyboardInterrupt) and not was_interrupted():
                raise
            raise typer.Exit(report_interrupt()) from None
