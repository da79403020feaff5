"""Reports: pages of text, tables and pictures about score files and experiments.

In: score files, robustness studies and teleoperation experiments. Out: pages, as HTML and Markdown,
and the pictures in them.
"""

from __future__ import annotations

from tcs.output.report.blocks import Page, Section
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.output.report.robustness.page import robustness_page
from tcs.output.report.robustness.paper import Paper, load_paper
from tcs.output.report.robustness.write import write_report
from tcs.output.report.score.files import report_paths, write_score_report
from tcs.output.report.score.page import make_score_page
from tcs.output.report.score.report import CheckSizes, ScoreReport, make_score_report
from tcs.output.report.score.row_pictures import RowPictures, draw_row, draw_rows

__all__ = [
    "CheckSizes",
    "Page",
    "Paper",
    "RowPictures",
    "ScoreReport",
    "Section",
    "as_html",
    "as_markdown",
    "draw_row",
    "draw_rows",
    "load_paper",
    "make_score_page",
    "make_score_report",
    "report_paths",
    "robustness_page",
    "write_report",
    "write_score_report",
]
