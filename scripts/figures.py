"""Rewrite the measured figures in README and docs from what the benchmarks saved.

Usage: python scripts/figures.py [--check]

A block between `<!-- figures: SCRIPT/TABLE -->` and `<!-- end of figures -->` becomes that table of
`benchmarks/figures/SCRIPT.json`, followed by machine, versions and command. With `--check` nothing
is written; the exit code is 1 when a page differs from the saved figures.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tcs.files.writing import whole_file

CHECKOUT = Path(__file__).resolve().parents[1]
FIGURES = CHECKOUT / "benchmarks" / "figures"
END = "<!-- end of figures -->"
BLOCK = re.compile(rf"(<!-- figures: (\w+)/(\w+) -->\n)(.*?)({re.escape(END)})", flags=re.S)


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
    """Return a page with every block made anew from the saved figures.

    Raises:
        KeyError: If a block names a table that was not saved.
        OSError: If a block names a script without saved figures.
    """

    def block(match: re.Match[str]) -> str:
        opening, script, table, _, end = match.groups()
        saved = json.loads((FIGURES / f"{script}.json").read_text(encoding="utf-8"))
        return f"{opening}\n{as_markdown(saved, table)}\n{end}"

    return BLOCK.sub(block, text)


def as_markdown(saved: Mapping[str, Any], table: str) -> str:
    """Return one saved table and where it was measured, as Markdown."""
    columns, rows = saved["tables"][table]["columns"], saved["tables"][table]["rows"]
    lines = [f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    lines += [f"| {' | '.join(cells)} |" for cells in rows]
    where = (
        f"*`{saved['command']}`, {saved['date']}: {saved['machine']}, load {saved['load']}; "
        f"Python {saved['python']}, {saved['versions']}.*"
    )
    return "\n".join([*lines, "", where, ""])


if __name__ == "__main__":
    sys.exit(main())
