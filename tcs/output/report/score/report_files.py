"""Files of the report of a score file: the page as HTML, as Markdown, or both."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcs.errors import OutputError
from tcs.files.writing import check_writable, whole_file
from tcs.output.report.blocks import Page
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.output.report.score.page import make_score_page
from tcs.output.report.score.report import ScoreReport

_FORMATS = {".html": as_html, ".md": as_markdown}


def report_paths(out: Path, *, markdown: bool = False) -> tuple[Path, ...]:
    """Return the files of a report, after a check that each can be written.

    Args:
        out: The page; its ending, .html or .md, decides the format.
        markdown: Whether to write the page as Markdown, too, under the same name.

    Raises:
        OutputError: If the ending is another one, or a file cannot be written.
    """
    if out.suffix.lower() not in _FORMATS:
        raise OutputError(f"Report '{out}': its name must end in one of {', '.join(_FORMATS)}.")
    beside = out.with_suffix(".md")
    paths = (out, beside) if markdown and beside != out else (out,)
    for path in paths:
        check_writable(path)
    return paths


def write_score_report(
    report: ScoreReport, paths: Sequence[Path], *, command: str
) -> dict[str, Any]:
    """Write the page of a report, and return a summary of both as plain containers.

    Args:
        report: The report.
        paths: Files to write, from `report_paths`.
        command: Command that makes the page; the page shows it.

    Raises:
        OutputError: If a file cannot be written.
    """
    page = make_score_page(report, command=command)
    sizes = [_write_page(path, page) for path in paths]
    return {"files": [str(path) for path in paths], "bytes": sizes, **report.to_json()}


def _write_page(path: Path, page: Page) -> int:
    """Write a page in the format of its ending, and return its size in bytes."""
    content = _FORMATS[path.suffix.lower()](page).encode()
    with whole_file(path, "Report") as stream:
        stream.write(content)
    return len(content)
