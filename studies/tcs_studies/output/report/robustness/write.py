"""Files of the robustness report: the page, its text as Markdown, every sample as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from pathlib import Path

from tcs.files.writing import make_folder, whole_file
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs.placement.robustness import Evaluation
from tcs_studies.output.report.robustness.page import RowPictures, robustness_page
from tcs_studies.output.report.robustness.paper import load_paper
from tcs_studies.robustness.comparison import method_name
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


COLUMNS = ("task", "environment", "method", "draw", "sample", "fraction", "goals", "members")
"""Columns of every table; the errors of the joints follow, in metres and radians."""


def evaluations(row: RowStudy) -> Iterator[tuple[str, str, Evaluation]]:
    """Yield method, draw ("common" or "independent") and result of every evaluation of a row."""
    yield "best set", "common", row.best
    yield "best single", "common", row.single
    if row.methods is not None:
        draws = (("common", row.methods.paired), ("independent", row.methods.independent))
        for draw, found in draws:
            for method, evaluation in found.items():
                yield method_name(method), draw, evaluation


def samples_csv(rows: Sequence[RowStudy]) -> bytes:
    """Return every sample as CSV: joint errors, goals reached and their weighted fraction.

    `goals` has a 1 for each goal that is reached, in the order of the task; `members` are numbers
    of configurations, as in `tcs export`.
    """
    joints = list(dict.fromkeys(name for row in rows for name in row.best.offsets))
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, *joints])
    for row in rows:
        for method, draw, found in evaluations(row):
            goals = ["".join("01"[int(g)] for g in reached) for reached in found.reached]
            sets = ["+".join(map(str, members)) for members in found.sets.tolist()]
            errors = [
                [f"{value:.6g}" for value in found.offsets[name]]
                if name in found.offsets
                else [""] * found.samples
                for name in joints
            ]
            for i, fraction in enumerate(found.fractions):
                members = sets[i] if len(sets) > 1 else sets[0]
                names = (row.task, row.environment, method, draw, i)
                cells = [f"{fraction:.9g}", goals[i], members, *(values[i] for values in errors)]
                writer.writerow([*names, *cells])
    return text.getvalue().encode()
