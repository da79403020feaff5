"""The command `tcs report`: everything about one score file on a page."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.errors import OutputError
from tcs.output import terminal

if TYPE_CHECKING:
    # `tcs list` gets by without drawing.
    from tcs.output.report import Page

ENDINGS = (".html", ".md")


def report(
    file: options.File,
    out: Annotated[
        Path,
        typer.Option(
            metavar="PAGE",
            help="Page to write: .html, which needs nothing else, or .md, its text and tables.",
        ),
    ],
    here: Annotated[tuple[float, float, float] | None, options.HERE] = None,
    torso: options.Torso = 0.0,
    max_members: options.Members = None,
    observed: options.Observed = None,
    markdown: Annotated[
        bool, typer.Option("--md", help="Write text and tables beside it as .md, too.")
    ] = False,
    pairs: Annotated[int, typer.Option(min=0, help="Reached pairs to re-check with Drake.")] = 500,
    dense: Annotated[
        int, typer.Option(min=0, help="Unreached and reached pairs to scan densely.")
    ] = 200,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Write a page about a score file: where to stand, how good that is, why, and how sure.

    With --here about the set chosen from there, else about the one with the best scores. Answers
    are re-checked with Drake; if one is false the page says so, and the exit code is 1.
    """
    from tcs.cli.values import observed_settings, state_if_given
    from tcs.files.writing import check_writable

    chosen_from = state_if_given(here, torso)
    paths = _paths(out, markdown=markdown)
    for path in paths:
        check_writable(path)

    import tcs
    from tcs.output.report import CheckSizes, make_score_page, make_score_report

    found = observed_settings(observed or (), tcs.load(file).observed_axes)
    with terminal.progress_bar("pairs re-checked") as on_progress:
        answer = make_score_report(
            file,
            here=chosen_from,
            max_members=max_members,
            observed=found,
            sizes=CheckSizes(pairs=pairs, dense=dense, seed=seed),
            on_progress=on_progress,
        )
    page = make_score_page(answer, command=shlex.join(["tcs", *sys.argv[1:]]))
    sizes = [_write(path, page) for path in paths]
    reachability, manipulability = answer.scores
    result = {
        "files": [str(path) for path in paths],
        "bytes": sizes,
        "members": [member.to_json() for member in answer.shown.members],
        # Seven sevenths add up to 1 only after rounding.
        "reachability": round(reachability, 12),
        "manipulability": round(manipulability, 12),
        "measure": answer.measure,
        "unreached_goals": list(answer.unreached),
        "verification": answer.verification.to_json(),
        "shown_checked": len(answer.findings),
        "shown_false": [goal for goal in answer.findings if not answer.is_confirmed(goal)],
        "is_sound": answer.is_sound,
        "seconds": answer.seconds,
    }
    terminal.print_result(result, _report, as_json=as_json)
    if not answer.is_sound:
        terminal.note(f"some answers in '{file}' are false; do not use them.")
        raise typer.Exit(1)


def _paths(out: Path, *, markdown: bool) -> list[Path]:
    """Return the files to write.

    Raises:
        OutputError: If the name does not say in which form.
    """
    if out.suffix.lower() not in ENDINGS:
        raise OutputError(f"Report '{out}': its name must end in one of {', '.join(ENDINGS)}.")
    beside = out.with_suffix(".md")
    return [out, beside] if markdown and beside != out else [out]


def _write(path: Path, page: Page) -> int:
    """Write a page in the form that its name asks for, and return its size in bytes."""
    from tcs.files.writing import whole_file
    from tcs.output.report import as_html, as_markdown

    form = as_html if path.suffix.lower() == ".html" else as_markdown
    content = form(page).encode()
    with whole_file(path, "Report") as stream:
        stream.write(content)
    return len(content)


def _report(result: dict[str, Any]) -> None:
    """Print what was written, and the verdict."""
    for name, size in zip(result["files"], result["bytes"], strict=True):
        typer.echo(f"wrote {name}: {size / 1e6:.2f} MB")
    checked, shown = result["verification"]["checked"], result["shown_checked"]
    if not checked and not shown:
        typer.echo(result["verification"]["verdict"])
        return
    verdict = "every answer holds" if result["is_sound"] else "SOME ANSWERS ARE FALSE"
    typer.echo(f"{shown} answers shown and {checked:,} others re-checked with Drake: {verdict}")
