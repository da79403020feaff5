"""Every sample of a study as a table in a file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence

from tcs.output.report.study import RowStudy
from tcs.placement.robustness import Evaluation, cell_name

COLUMNS = ("task", "environment", "method", "draw", "sample", "share", "goals", "members")
"""Columns of every table; the errors of the joints follow, in metres and radians."""


def evaluations(row: RowStudy) -> Iterator[tuple[str, str, Evaluation]]:
    """Yield method, draw and samples of everything that was tried for one row."""
    yield "best set", "common", row.best
    yield "best single", "common", row.single
    if row.methods is not None:
        for draw, found in (("common", row.methods.cells), ("own", row.methods.independent)):
            for cell, evaluation in found.items():
                yield cell_name(cell), draw, evaluation


def samples_csv(rows: Sequence[RowStudy]) -> bytes:
    """Return every sample as CSV: what was off, and what was reached.

    `goals` has a 1 for each goal that was reached, in order; `members` are numbers of
    configurations, as in `tcs export`.
    """
    joints = list(dict.fromkeys(name for row in rows for name in row.best.offsets))
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, *joints])
    for row in rows:
        for method, draw, found in evaluations(row):
            goals = ["".join("01"[int(g)] for g in reached) for reached in found.reached]
            sets = ["+".join(map(str, members)) for members in found.sets.tolist()]
            off = [
                [f"{value:.6g}" for value in found.offsets[name]]
                if name in found.offsets
                else [""] * found.samples
                for name in joints
            ]
            for i, share in enumerate(found.shares):
                members = sets[i] if len(sets) > 1 else sets[0]
                names = (row.task, row.environment, method, draw, i)
                writer.writerow([*names, f"{share:.9g}", goals[i], members, *(v[i] for v in off)])
    return text.getvalue().encode()
