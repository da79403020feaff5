"""Files of the report of a study: the page, and every table, trial and answer as CSV."""

from __future__ import annotations

import csv
import io
import re
import shlex
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tcs.files.writing import check_page, make_folder, whole_file
from tcs.output.report.blocks import Block, Collapsible, Page, Table
from tcs.output.report.html import as_html
from tcs_studies.experiment.trial import MEASURES
from tcs_studies.output.report.experiment.tables import compared_pairs
from tcs_studies.output.report.study.page import study_page
from tcs_studies.study.results import OnProgress, StudyResults, study_results
from tcs_studies.study.steps import steps_of
from tcs_studies.study.study_file import Study


def write_study_report(
    study: Study, out: Path | None = None, *, on_progress: OnProgress | None = None
) -> dict[str, Any]:
    """Write the report of a study, and return a summary as plain containers.

    Args:
        study: The study.
        out: The page; None for `report.html` in the folder of the study. The tables go to a folder
            beside it, e.g. `report-tables`.
        on_progress: Called with the numbers of participants read and in total.

    Raises:
        DataFileError: If the file of a participant is invalid, or no participant is complete.
        OutputError: If a file cannot be written.
    """
    page_path = out or study.folder / "report.html"
    check_page(page_path)
    results = study_results(study, on_progress=on_progress)
    words = ["tcs", "study", "report", str(study.folder)]
    words += [] if out is None else ["--out", str(out)]
    page = study_page(results, command=shlex.join(words))
    folder = page_path.parent / f"{page_path.stem}-tables"
    make_folder(folder)
    contents = {
        "trials": _csv(_trial_rows(results)),
        "answers": _csv(_answer_rows(results)),
        "values": _csv(_value_rows(results)),
        **{name: table_csv(table) for name, table in named_tables(page)},
    }
    paths = [page_path, *(folder / f"{name}.csv" for name in contents)]
    for path, content in zip(paths, [as_html(page).encode(), *contents.values()], strict=True):
        with whole_file(path, "Report") as stream:
            stream.write(content)
    return {**summary(results), "files": [str(path) for path in paths]}


def summary(results: StudyResults) -> dict[str, Any]:
    """Return participants, statistics, tests and preferences as plain containers."""
    comparison, conditions = results.comparison, list(results.comparison.titles)
    groups = {
        name: {condition: _group(results, name, condition) for condition in conditions}
        for name in comparison.values
    }
    tests: dict[str, dict[str, Any]] = {}
    for name in comparison.hypotheses:
        for first, second in compared_pairs(comparison):
            test = comparison.compared(name, first, second)
            tests.setdefault(name, {})[f"{first} - {second}"] = (
                None if test is None else test.to_json()
            )
    variance = {name: comparison.varied(name) for name in comparison.anova_measures}
    found = {
        "title": results.study.plan.title,
        "scripted": any(trial.is_scripted for trial in results.trials),
        "participants": [
            {
                "participant": one.participant,
                "order": one.order,
                "included": one in results.included,
                "dropped": one.dropped,
            }
            for one in results.participants
        ],
        "groups": groups,
        "tests": tests,
        "variance": {
            name: None if one is None else one.to_json() for name, one in variance.items()
        },
        "preferred": {condition: results.preferred()[condition] for condition in conditions},
        "notes": list(results.notes),
    }
    return {key: _finite(value) for key, value in found.items()}


def _finite(value: Any) -> Any:
    """Return plain containers with None for numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _group(results: StudyResults, measure: str, condition: str) -> dict[str, Any]:
    """Return the statistics of a sample; None for what it is too small for."""
    sample = results.comparison.sample(condition, measure)
    found = results.comparison.described(condition, measure)
    values = {
        "median": float(np.median(sample)) if len(sample) else None,
        "mean": float(sample.mean()) if len(sample) else None,
        "std": float(sample.std(ddof=1)) if len(sample) > 1 else None,
        "shapiro_w": None if found is None else found.shapiro_w,
        "shapiro_p": None if found is None else found.shapiro_p,
        "francia_w": None if found is None else found.francia_w,
        "francia_p": None if found is None else found.francia_p,
    }
    return {"count": len(sample), **values}


def named_tables(page: Page) -> list[tuple[str, Table]]:
    """Return every table of a page with a name from its section, e.g. "trials-2"."""
    found = []
    for section in page.sections:
        tables = list(_tables(section.blocks))
        for number, table in enumerate(tables, start=1):
            name = section.anchor if len(tables) == 1 else f"{section.anchor}-{number}"
            found.append((f"table-{name}", table))
    return found


def _tables(blocks: Sequence[Block]) -> Iterable[Table]:
    for block in blocks:
        if isinstance(block, Table):
            yield block
        elif isinstance(block, Collapsible):
            yield from _tables(block.blocks)


def table_csv(table: Table) -> bytes:
    """Return a table as CSV, with the texts of the page."""
    return _csv([[column.title for column in table.columns], *table.texts()])


def _trial_rows(results: StudyResults) -> list[list[object]]:
    """Return every trial of the included participants, in SI units."""
    first = ["participant", "condition", "order", "training", "trial", *MEASURES]
    rows: list[list[object]] = [list(first)]
    for trial in results.trials:
        step = trial.step
        values = [f"{getattr(trial.measures, name):.9g}" for name in MEASURES]
        rows.append(
            [trial.participant, step.condition, trial.place, step.training, step.number, *values]
        )
    return rows


def _answer_rows(results: StudyResults) -> list[list[object]]:
    """Return every answer of every participant, also of those that are left out."""
    rows: list[list[object]] = [
        ["participant", "included", "condition", "questionnaire", "question", "answer"]
    ]
    for one in results.participants:
        for step in steps_of(results.study, one.order):
            for question, answer in results.form_answers(one, step.key).items():
                included = one in results.included
                rows.append(
                    [one.participant, included, step.condition or "", step.form, question, answer]
                )
    return rows


def _value_rows(results: StudyResults) -> list[list[object]]:
    """Return the values that the tests compare: one per participant, condition and measure."""
    comparison = results.comparison
    rows: list[list[object]] = [["participant", "condition", *comparison.values]]
    for i, one in enumerate(results.included):
        for condition in comparison.titles:
            values = [comparison.values[name][condition][i] for name in comparison.values]
            cells = ["" if np.isnan(value) else f"{value:.9g}" for value in values]
            rows.append([one.participant, condition, *cells])
    return rows


def _csv(rows: Iterable[Sequence[object]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        writer.writerow([_harmless(cell) for cell in row])
    return text.getvalue().encode()


def _harmless(cell: object) -> object:
    """Return a cell that a spreadsheet does not take for a formula; numbers stay as they are."""
    if isinstance(cell, str) and re.match(r"[=@\t\r]|[+-](?![0-9.])", cell):
        return f"'{cell}"
    return cell
