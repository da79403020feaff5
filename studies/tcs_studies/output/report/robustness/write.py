"""Files of the robustness report: the page, its text as Markdown and every sample as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tcs.files.writing import make_folder, whole_file
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs_studies.output.report.robustness.page import robustness_page
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.output.report.robustness.row_pictures import RowPictures
from tcs_studies.output.report.robustness.samples import samples_csv
from tcs_studies.robustness.study import RowStudy, StudyPlan

NAMES = ("robustness.html", "robustness.md", "samples.csv")
"""Names of the files in the folder."""


def write_report(
    folder: Path,
    rows: Sequence[RowStudy],
    pictures: Sequence[RowPictures],
    plan: StudyPlan,
    *,
    seconds: float,
    command: str,
) -> tuple[Path, ...]:
    """Write a robustness report, each file completely or not at all, and return their paths.

    Args:
        folder: Folder of the files, created if missing.
        rows: Results of each row.
        pictures: Pictures of each row.
        plan: Sample sizes of the study.
        seconds: Wall-clock time of the study [s].
        command: Command that makes the report.

    Raises:
        OutputError: If a file cannot be written.
    """
    make_folder(folder)
    page = robustness_page(rows, pictures, load_paper(), plan, seconds=seconds, command=command)
    contents = (as_html(page).encode(), as_markdown(page).encode(), samples_csv(rows))
    paths = tuple(folder / name for name in NAMES)
    for path, content in zip(paths, contents, strict=True):
        with whole_file(path, "Report") as stream:
            stream.write(content)
    return paths
