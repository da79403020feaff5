"""In how many rooms all goals are done: from the set of the greatest scores, and the surest one.

Usage: python benchmarks/rooms_done.py FILE [FILE ...] [--rooms 1000] [--seed 99]

Person and furniture of each room are displaced by the papers' errors. The surest set is found by
`tcs robustify` in rooms of another seed. The best single stop stands beside them: what a second
stop gains.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from table import cell, header, parser, row, save

import tcs
from tcs.output.words import percentage


def main() -> int:
    """Judge the sets of every file in the same rooms."""
    command_line = parser(__doc__)
    command_line.add_argument("files", nargs="+", type=Path)
    command_line.add_argument("--rooms", type=int, default=1000)
    command_line.add_argument("--seed", type=int, default=99)
    options = command_line.parse_args()
    header()
    for path in options.files:
        file = tcs.load(path)
        begun = time.perf_counter()
        estimated = tcs.robustify(file)
        seconds = time.perf_counter() - begun
        cells = {"finding the surest set [s]": f"{seconds:.0f}"}
        sets = {"one stop": "single", "greatest scores": "best", "surest": "robust"}
        for name, select in sets.items():
            found = tcs.evaluate(estimated, samples=options.rooms, seed=options.seed, select=select)
            low, high = found.rooms_done_ci95
            cells[name] = (
                f"{percentage(found.rooms_done)} ({percentage(low)} to {percentage(high)})"
            )
            if select == "robust":
                cells["its stops"] = str(len(found.members))
        for column, text in cells.items():
            row(f"{path.stem}: {column}", text)
            cell("rooms", path.stem, column, text)
        save(options, keep=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
