"""Reports: pages of text, tables and pictures about score files and experiments.

In: score files, robustness studies and teleoperation experiments. Out: pages, as HTML and Markdown,
and the pictures in them.
"""

from __future__ import annotations

from tcs.output.report.blocks import Page, Section
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.output.report.paper import Paper, load_paper
from tcs.output.report.robustness import robustness_page
from tcs.output.report.row_pictures import RowPictures, draw_row, draw_rows
from tcs.output.report.score_files import report_paths, write_score_report
from tcs.output.report.score_page import make_score_page
from tcs.output.report.score_report import CheckSizes, ScoreReport, make_score_report
from tcs.output.report.write import write_report

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
