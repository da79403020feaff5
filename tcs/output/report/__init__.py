"""Reports: pages of text, tables and pictures about score files.

In: score files. Out: pages, as HTML and Markdown, and the pictures in them.
"""

from __future__ import annotations

from tcs.output.report.blocks import Page, Section
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.output.report.score.page import make_score_page, report_paths, write_score_report
from tcs.output.report.score.report import CheckSizes, ScoreReport, make_score_report

__all__ = [
    "CheckSizes",
    "Page",
    "ScoreReport",
    "Section",
    "as_html",
    "as_markdown",
    "make_score_page",
    "make_score_report",
    "report_paths",
    "write_score_report",
]
