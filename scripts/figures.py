"""Rewrite the measured figures in README and docs from what the benchmarks saved.

Usage: python scripts/figures.py [--check]

- A block between `<!-- figures: SCRIPT/TABLE -->` and `<!-- end of figures -->` becomes that table
  of `benchmarks/figures/SCRIPT.json`, or the output of a command that is saved there.
- What stands between `<!-- figure: SCRIPT/TABLE | ROW | COLUMN -->` and `<!-- -->` in a sentence
  becomes that cell.

What has not been saved yet keeps what the page holds. Machine, versions and command stand after the
last table of a script in a section, and after the last output in a page. With `--check` nothing is
written; the exit code is 1 when a page differs from the saved figures.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tcs.files.writing import whole_file

CHECKOUT = Path(__file__).resolve().parents[1]
FIGURES = CHECKOUT / "benchmarks" / "figures"
END = "<!-- end of figures -->"
UNSAVED = "\n*Not saved yet: run `make benchmark-save`.*\n\n"
"""Content of an empty block whose table has not been saved."""
BLOCK = re.compile(rf"(<!-- figures: (\w+)/(\w+) -->\n)(.*?)({re.escape(END)})", flags=re.S)
CELL = re.compile(r"(<!-- figure: (\w+)/(\w+) \| ([^|\n]+) \| ([^|\n]+?) -->)(.*?)(<!-- -->)")
_FENCE = re.compile(r"^ *(```+|~~~+).*?^ *\1 *$", flags=re.S | re.M)
_CODE = re.compile(r"`[^`\n]+`|\$\$.*?\$\$|<!--.*?-->", flags=re.S)
MEASURED = re.compile(
    r"(?<![\w.])\d[\d.,]*(?: |-)?"
    r"(?:%|(?:ns|us|µs|ms|s|seconds|min|minutes|hours|kB|MB|GB|percent|percentage points|times)\b)"
)
"""A number with a unit of time, memory or proportion, as benchmarks measure them."""


def main() -> int:
    """Rewrite or check every page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing")
    options = parser.parse_args()
    differing = 0
    for page in pages():
        text = page.read_text(encoding="utf-8")
        made = rewritten(text)
        if made == text:
            continue
        differing += 1
        print(f"{page.relative_to(CHECKOUT)}: {'differs' if options.check else 'rewritten'}")
        if not options.check:
            with whole_file(page, "Page") as file:
                file.write(made.encode())
    return 1 if options.check and differing else 0


def pages() -> list[Path]:
    """Return README and all pages of the docs."""
    return [CHECKOUT / "README.md", *sorted((CHECKOUT / "docs").rglob("*.md"))]


def rewritten(text: str) -> str:
    """Return a page with every block and every cell made anew from the saved figures.

    Raises:
        KeyError: If a cell names a row or column that was not saved.
    """

    def block(match: re.Match[str]) -> str:
        opening, script, table, held, end = match.groups()
        if not is_saved(script, table):
            return f"{opening}{held if held.strip() else UNSAVED}{end}"
        saved = saved_figures(script)
        following = text[match.end() :]
        if "text" not in saved["tables"][table]:
            following = re.split(r"^#+ ", following, maxsplit=1, flags=re.M)[0]
        is_last = not re.search(rf"<!-- figures: {script}/", following)
        return f"{opening}\n{as_markdown(saved, table, source=is_last)}\n{end}"

    def cell(match: re.Match[str]) -> str:
        opening, script, table, row, column, _, end = match.groups()
        if not is_saved(script, table):
            return match[0]
        return opening + cell_of(saved_figures(script), table, row, column) + end

    return CELL.sub(cell, BLOCK.sub(block, text))


def is_saved(script: str, table: str) -> bool:
    """Return whether a benchmark saved a table of this name."""
    path = FIGURES / f"{script}.json"
    return path.exists() and table in saved_figures(script)["tables"]


def unsaved(text: str) -> set[str]:
    """Return the blocks and cells of a page that no benchmark has saved, as SCRIPT/TABLE."""
    named = [match[1:3] for pattern in (BLOCK, CELL) for match in pattern.findall(text)]
    return {f"{script}/{table}" for script, table in named if not is_saved(script, table)}


def saved_figures(script: str) -> dict[str, Any]:
    """Return what a benchmark saved.

    Raises:
        OSError: If it saved nothing.
    """
    saved: dict[str, Any] = json.loads((FIGURES / f"{script}.json").read_text(encoding="utf-8"))
    return saved


def as_markdown(saved: Mapping[str, Any], table: str, *, source: bool = True) -> str:
    """Return one saved table or text, and where it was measured, as Markdown.

    Args:
        saved: Of one script.
        table: Name of the table.
        source: Whether machine, versions and command follow; those of rows that were kept from
            earlier runs always do.
    """
    found = saved["tables"][table]
    if "text" in found:
        lines = ["```text", *found["text"].splitlines(), "```"]
    else:
        columns, rows = found["columns"], found["rows"]
        lines = [f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
        lines += [f"| {' | '.join(cells)} |" for cells in rows]
    lines += earlier_lines(saved.get("earlier", {}).get(table, ()))
    if source:
        lines += ["", f"*{run_text(saved)}*"]
    return "\n".join([*lines, ""])


def earlier_lines(runs: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return where rows that were kept from earlier runs were measured, a paragraph a machine."""
    by_machine: dict[str, list[str]] = {}
    for run in runs:
        machine = f"{run['machine']}; Python {run['python']}, {run['versions']}"
        measured = f"`{run['command']}`, {run['date']}, load {run['load']}"
        by_machine.setdefault(machine, []).append(f"{'; '.join(run['rows'])}: {measured}")
    return [
        line
        for machine, measured in by_machine.items()
        for line in ("", f"*Earlier, on {machine}: {'. '.join(measured)}.*")
    ]


def run_text(run: Mapping[str, Any]) -> str:
    """Return command, date, machine and versions of a run of a benchmark."""
    return (
        f"`{run['command']}`, {run['date']}: {run['machine']}, load {run['load']}; "
        f"Python {run['python']}, {run['versions']}."
    )


def cell_of(saved: Mapping[str, Any], table: str, row: str, column: str) -> str:
    """Return one cell of a saved table.

    Raises:
        KeyError: If there is no such table, row or column.
    """
    found = saved["tables"][table]
    if column not in found["columns"]:
        raise KeyError(f"table '{table}' has no column '{column}': {found['columns']}")
    texts = {cells[0]: cells[found["columns"].index(column)] for cells in found["rows"]}
    return str(texts[row])


def typed_figures(text: str) -> list[tuple[int, str]]:
    """Return numbers with a unit of time, memory or proportion that are typed into a page.

    Blocks, cells, fences, code and comments do not count.

    Returns:
        Line number, counted from 1, and number with unit, for each.
    """
    for pattern in (BLOCK, CELL, _FENCE, _CODE):
        # Line numbers stay as they are.
        text = pattern.sub(lambda match: "\n" * match[0].count("\n"), text)
    return [
        (number, found)
        for number, line in enumerate(text.splitlines(), start=1)
        for found in MEASURED.findall(line)
    ]


if __name__ == "__main__":
    sys.exit(main())
