"""The folder of the pick-and-place experiment: page, table of repetitions, pictures."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tcs.files.writing import check_writable, make_folder, whole_file
from tcs.output.draw import save_figure
from tcs.output.report.html import as_html
from tcs.output.report.markdown import as_markdown
from tcs_studies.output.report.pick_and_place.page import PANELS, figures, pick_and_place_page
from tcs_studies.pick_and_place.analysis import summary
from tcs_studies.pick_and_place.protocol import PickAndPlace, Plan, run_pick_and_place
from tcs_studies.pick_and_place.repetition import MEASURES

FILES = ("pick-and-place.html", "pick-and-place.md", "repetitions.csv")
PICTURES = tuple(f"{name}.png" for name in (*PANELS, "figure-51", "figure-52", "figure-53"))


def write_pick_and_place(
    plan: Plan,
    out: Path | None,
    *,
    command: str,
    jobs: int = 1,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Run the experiment, write its folder and return a summary as plain containers.

    Args:
        plan: Size, seed and variations.
        out: The folder for `FILES` and `PICTURES`; None to write nothing.
        command: The command that repeats the experiment.
        jobs: Number of processes; the results do not depend on it.
        on_progress: Called with the number of operators done and of all.

    Raises:
        OutputError: If a file cannot be written.
        TcsError: If the robot cannot be used.
    """
    began = time.monotonic()
    if out is not None:
        make_folder(out)
        for name in (*FILES, *PICTURES):
            check_writable(out / name)
    result = run_pick_and_place(plan, jobs=jobs, on_progress=on_progress)
    seconds = time.monotonic() - began
    files = () if out is None else _write(result, out, seconds, command)
    return {**summary(result), "seconds": seconds, "files": [str(path) for path in files]}


def _write(result: PickAndPlace, out: Path, seconds: float, command: str) -> tuple[Path, ...]:
    """Write page, table and pictures; return their paths."""
    drawn = figures(result)
    page = pick_and_place_page(result, drawn, seconds=seconds, command=command)
    contents = (as_html(page).encode(), as_markdown(page).encode(), _repetitions(result))
    for name, content in zip(FILES, contents, strict=True):
        with whole_file(out / name, "Report") as stream:
            stream.write(content)
    for name, (figure, _) in drawn.items():
        save_figure(out / f"{name}.png", figure)
    return tuple(out / name for name in (*FILES, *PICTURES))


def _repetitions(result: PickAndPlace) -> bytes:
    """Return every repetition as CSV, in SI units; failed ones have an outcome and no measures."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["scripted_operator", "part", "condition", "success", "outcome", *MEASURES])
    for number, operator in enumerate(result.operators, start=1):
        parts = [("familiarisation", "familiarisation", operator.familiarisation)]
        parts += [("training", name, part) for name, part in operator.training.items()]
        parts += [("experiment", name, part) for name, part in operator.recorded.items()]
        for part, condition, found in parts:
            for i, done in enumerate(found.successes, start=1):
                values = [f"{getattr(done, name):.9g}" for name in MEASURES]
                writer.writerow([number, part, condition, i, "done", *values])
            for outcome in found.failures:
                writer.writerow([number, part, condition, "", outcome, *[""] * len(MEASURES)])
    return text.getvalue().encode()
