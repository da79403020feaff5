"""What every benchmark prints and saves: machine, versions, and measured values with their spread.

A benchmark run with `--save` writes what it measured to `benchmarks/figures/<script>.json`. The
tables in README and docs are made from those files by `make figures`. A benchmark whose rows can be
measured one by one keeps the saved rows that a run did not measure, with the run they are of.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shlex
import statistics
import sys
import tomllib
from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tcs.files.writing import make_folder, whole_file

if TYPE_CHECKING:
    from tcs.output.report.blocks import Table
    from tcs.placement.scoring import Verification

CHECKOUT = Path(__file__).resolve().parents[1]
FIGURES = CHECKOUT / "benchmarks" / "figures"
PACKAGES = ("tcs", "drake", "numba", "numpy", "scipy", "joblib", "example-robot-data")
_cells: dict[str, dict[str, dict[str, str]]] = {}
"""Cells by table, row and column, in the order in which they were measured."""
_tables: dict[str, dict[str, str | list[str] | list[list[str]]]] = {}
"""Tables that were recorded as a whole, and texts."""
_began: dict[str, str] = {}


def parser(description: str) -> argparse.ArgumentParser:
    """Return a parser with the option `--save`, described by a docstring's first line."""
    options = argparse.ArgumentParser(description=description.splitlines()[0])
    options.add_argument(
        "--save",
        action="store_true",
        help="write benchmarks/figures/<script>.json, from which `make figures` makes the docs",
    )
    return options


def header(*packages: str) -> None:
    """Print machine, load and versions, of our own packages and of the additional ones named."""
    _began["machine"] = f"{platform.machine()}, {processor()}"
    _began["load"] = ", ".join(f"{load:.2f}" for load in os.getloadavg())
    _began["python"] = platform.python_version()
    _began["versions"] = ", ".join(f"{name} {_version(name)}" for name in (*PACKAGES, *packages))
    row("machine", _began["machine"])
    row("load at the start", _began["load"])
    row("python", _began["python"])
    row("versions", _began["versions"])


def row(name: str, text: str) -> None:
    """Print one line of the table, its columns two spaces or more apart."""
    print(f"{name:<33}  {text}", flush=True)


def cell(table: str, line: str, column: str, text: str) -> None:
    """Record one cell of a table for the docs.

    Args:
        table: Name of the table, by which a page refers to it.
        line: What was measured, with its unit: the first cell of the line.
        column: Heading of the column, such as the robot.
        text: The measured value.
    """
    _cells.setdefault(table, {}).setdefault(line, {})[column] = text


def record(table: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Record a whole table for the docs.

    Args:
        table: Name of the table, by which a page refers to it.
        columns: Headings.
        rows: Cells, as many in each row as there are headings.
    """
    _tables[table] = {"columns": list(columns), "rows": [list(cells) for cells in rows]}


def record_table(name: str, table: Table) -> None:
    """Record a table of a report for the docs."""
    record(name, [column.title for column in table.columns], table.texts())


def record_text(name: str, text: str) -> None:
    """Record the output of a command for the docs, where it stands in a fence."""
    _tables[name] = {"text": text}


def save(
    options: argparse.Namespace, *, keep: bool = False, measured: Collection[str] = ()
) -> None:
    """Write the recorded tables where `--save` was given.

    Args:
        options: The command line.
        keep: Whether saved tables, and rows with another first cell, that this run did not measure
            are kept, with the run they are of.
        measured: First cells of which this run would have recorded rows in each of its tables: a
            table that has none of them keeps no earlier ones.
    """
    if not options.save:
        return
    script = Path(sys.argv[0])
    for table, lines in _cells.items():
        columns = list(dict.fromkeys(column for cells in lines.values() for column in cells))
        rows = [[line, *(cells.get(c, "") for c in columns)] for line, cells in lines.items()]
        record(table, ["", *columns], rows)
    saved: dict[str, Any] = {
        "command": shlex.join(
            ["python", f"benchmarks/{script.name}", *(a for a in sys.argv[1:] if a != "--save")]
        ),
        "date": datetime.now(UTC).date().isoformat(),
        **_began,
        "tables": dict(_tables),
    }
    make_folder(FIGURES)
    path = FIGURES / f"{script.stem}.json"
    if keep and path.exists():
        before = json.loads(path.read_text(encoding="utf-8"))
        saved = with_earlier(saved, before, measured)
    with whole_file(path, "Figures") as file:
        file.write(json.dumps(saved, indent=1, ensure_ascii=False).encode() + b"\n")
    print(f"wrote {path}")


def with_earlier(
    saved: dict[str, Any], before: dict[str, Any], measured: Collection[str] = ()
) -> dict[str, Any]:
    """Return what a run saved, with the tables and rows of earlier runs that it did not measure.

    Rows are the same if their first cells are. A table that this run has with other columns, or
    as a text, replaces the earlier one.

    Args:
        saved: What `save` writes, of this run.
        before: What was written before. Its key `earlier` has, for each table, the runs that rows
            were kept from: their first cells, command, date, machine, load and versions.
        measured: First cells that this run measured, whether it has rows of them or not.
    """
    tables, earlier = {}, {}
    for name in dict.fromkeys([*before["tables"], *saved["tables"]]):
        old, new = before["tables"].get(name), saved["tables"].get(name)
        if new is not None and (old is None or new.get("columns") != old.get("columns", ())):
            tables[name] = new
            continue
        found: dict[str, list[list[str]]] = {}
        if new is not None:
            found = {first: [] for first in measured}
            for cells in new["rows"]:
                found.setdefault(cells[0], []).append(cells)
        before_of = [cells[0] for cells in old.get("rows", [["all"]])]
        kept = [first for first in dict.fromkeys(before_of) if first not in found]
        tables[name] = old
        if new is not None:
            # Rows of one first cell stay together, where they were.
            rows: dict[str, list[list[str]]] = {first: [] for first in before_of} | found
            for cells in old["rows"]:
                if cells[0] not in found:
                    rows[cells[0]].append(cells)
            tables[name] = {**new, "rows": [cells for group in rows.values() for cells in group]}
        runs = _runs_of(kept, name, saved, before)
        if runs:
            earlier[name] = runs
    return {**saved, "tables": tables, **({"earlier": earlier} if earlier else {})}


def _runs_of(
    rows: list[str], table: str, saved: dict[str, Any], before: dict[str, Any]
) -> list[dict[str, Any]]:
    """Return the earlier runs that rows of a table are of, without those of the present command."""
    runs = [dict(run) for run in before.get("earlier", {}).get(table, ())]
    named = {row for run in runs for row in run["rows"]}
    last = {key: before[key] for key in before if key not in ("tables", "earlier")}
    runs.append({"rows": [row for row in rows if row not in named], **last})
    for run in runs:
        run["rows"] = [row for row in run["rows"] if row in rows]
    present = {key: saved[key] for key in saved if key != "tables"}
    return [run for run in runs if run["rows"] and run != {"rows": run["rows"], **present}]


def saved_rows(table: str, columns: Sequence[str]) -> dict[str, list[str]]:
    """Return the rows of a table that earlier runs of this script saved, by their first cells."""
    path = FIGURES / f"{Path(sys.argv[0]).stem}.json"
    saved = json.loads(path.read_text(encoding="utf-8"))["tables"] if path.exists() else {}
    if saved.get(table, {}).get("columns") != list(columns):
        return {}
    return {cells[0]: cells for cells in saved[table]["rows"]}


def spread(seconds: list[float], unit: str = "s", scale: float = 1.0) -> str:
    """Return median and range."""
    values = [scale * s for s in seconds]
    middle, low, high = statistics.median(values), min(values), max(values)
    return f"{middle:.3f} {unit} (median of {len(values)}, {low:.3f} .. {high:.3f})"


def processor() -> str:
    """Return the processor's name and how many cores there are."""
    names = [
        line.split(":", 1)[1].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    return f"{names[0]} x {len(names)}" if names else platform.processor()


def _version(name: str) -> str:
    """Return a version; ours is that of the checkout, whatever is installed."""
    if name == "tcs":
        project = tomllib.loads((CHECKOUT / "pyproject.toml").read_text(encoding="utf-8"))
        return str(project["project"]["version"])
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"


def recall_text(found: Verification, decimals: int = 5) -> str:
    """Return the recall with its interval, or why it is not estimated."""
    if found.recall is None or found.recall_ci95 is None:
        return found.recall_note or ""
    low, high = found.recall_ci95
    return f"{found.recall:.{decimals}f} ({low:.4f} .. {high:.4f})"


def check_texts(found: Verification) -> dict[str, str]:
    """Return the cells of a table of re-checked score files, by the heading of their columns."""
    return {
        "false, of those re-checked": f"{found.false_reached:,} of {found.checked:,}",
        "missed, of those scanned": f"{found.missed:,} of {found.dense_checked:,}",
        "recall (95 % interval)": recall_text(found, 4),
    }


def verification_text(found: Verification, seconds: float) -> str:
    """Return the result of re-checking a score file on one line."""
    values = {
        "position error [m]": found.max_position_error,
        "rotation error [rad]": found.max_rotation_error,
        f"{found.measure} error": found.max_isotropy_error,
        "mean shortfall": found.mean_shortfall,
    }
    errors = (f"{name} {value:.1e}" for name, value in values.items() if value is not None)
    return (
        f"checked {found.checked}, false {found.false_reached}, {', '.join(errors)}, "
        f"missed {found.missed} of {found.dense_checked}, recall {recall_text(found)}, "
        f"{seconds:.0f} s"
    )
