"""Hand thousands of mutated files of every type to tcs, and count what becomes of them.

A mutant is refused in one line, or accepted; anything else is a defect: a traceback, a process
that ends, a hang, or a false answer. Accepted tasks, environments, models and robots are scored on
a small grid, one in `--score-every`, and Drake re-checks some of the answers.

    python benchmarks/fuzz.py --mutants 10000 --score-every 100 --save
    python benchmarks/fuzz.py --mutants 1 --only URDF --first 1234    # one mutant again
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import table
from fuzz_files import FileType
from fuzz_further_files import ALL_TYPES, prepare
from fuzz_mutations import damaged
from worker import Worker

SECONDS = 10.0
"""Most processor time for one mutant [s]; scoring one takes a second or two."""
MEMORY = 2 * 1024**3
"""Most memory that a mutant may take beyond that of a started worker [bytes]."""
DAMAGED = 0.2
"""Fraction of the mutants that are damaged byte by byte rather than in their structure."""
MAX_CONFIGURATIONS = 2_000
"""Largest grid of an accepted environment that is scored."""
PAIRS = 12
"""Reached pairs that Drake re-checks for a mutant that is scored."""

OUTCOMES = ("refused", "accepted", "scored", "traceback", "abort", "hang", "false answer")
DEFECTS = ("traceback", "abort", "hang", "false answer")


def mutant(file_type: FileType, original: bytes, seed: int, number: int) -> bytes:
    """Return a mutant; the same arguments give the same bytes."""
    rng = np.random.default_rng([seed, zlib.crc32(file_type.name.encode()), number])
    if rng.random() < DAMAGED:
        return damaged(original, rng)
    return file_type.mutate(original, rng)


def judged(file_type: FileType, path: Path, number: int, score: bool) -> tuple[str, str]:
    """Return what becomes of the file at a path: one of OUTCOMES, and a text.

    The text is the message or the traceback; for a mutant that was scored, the number of reached
    pairs that Drake has re-checked.
    """
    from tcs.errors import TcsError

    try:
        three = file_type.use(path, number)
        if three is None or not score:
            return "accepted", ""
        return _scored(*three)
    except TcsError as error:
        text = str(error)
        if not text or "\n" in text or len(text) > 20_000:
            return "traceback", f"not one line: {text[:500]!r}"
        return "refused", text
    except BaseException:
        return "traceback", traceback.format_exc()[-3000:]


def _scored(task: Path, environment: Path, robot: Path | str) -> tuple[str, str]:
    """Score an accepted file and let Drake re-check some of the answers."""
    import tcs
    from tcs.placement.scoring.job import load_job

    job = load_job(task, environment, robot)
    if job.scored_grid.size > MAX_CONFIGURATIONS:
        return "accepted", ""
    scores = tcs.score(task, environment, robot, approach=False)
    found = tcs.verify(scores, pairs=PAIRS, dense=0)
    if not found.is_sound:
        return "false answer", json.dumps(found.to_json())
    return "scored", str(found.checked)


def work(name: str, folder: Path, seed: int, score_every: int) -> None:
    """Judge the mutants whose numbers arrive on stdin; print one line of JSON for each."""
    (file_type,) = (one for one in ALL_TYPES if one.name == name)
    answers = os.fdopen(os.dup(1), "w")
    # Drake and its libraries print warnings.
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    # Beside the one line a user would see the warning.
    warnings.simplefilter("error", RuntimeWarning)
    path = folder / file_type.file
    original = path.read_bytes()
    # Compile or load whatever is slow the first time.
    outcome, text = judged(file_type, path, 0, score=True)
    assert outcome in ("accepted", "scored"), text
    virtual = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (virtual + MEMORY, virtual + MEMORY))
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        number = json.loads(line)
        path.write_bytes(mutant(file_type, original, seed, number))
        begun = time.process_time()
        outcome, text = judged(file_type, path, number, score=number % score_every == 0)
        answer = {"outcome": outcome, "text": text, "seconds": time.process_time() - begun}
        print(json.dumps(answer), file=answers, flush=True)


def answers_of(
    name: str, numbers: range, options: argparse.Namespace, folder: Path
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield number and answer of each mutant of a type."""
    seed, score_every = str(options.seed), str(options.score_every)
    words = ["--only", name, "--seed", seed, "--score-every", score_every]
    worker = Worker(Path(__file__), words, folder, SECONDS)
    try:
        for number in numbers:
            yield number, worker.judge(number)
    finally:
        worker.close()


def main() -> None:
    """Fuzz every type and print a table."""
    command_line = table.parser(__doc__ or "")
    command_line.add_argument("--mutants", type=int, default=300, help="mutants of each type")
    command_line.add_argument("--first", type=int, default=0, help="number of the first mutant")
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument(
        "--score-every", type=int, default=5, help="score one mutant in so many"
    )
    command_line.add_argument("--only", nargs="*", help="types of files, by default all")
    command_line.add_argument(
        "--show", type=int, default=3, help="defects of a type to print in full"
    )
    command_line.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = command_line.parse_args()
    if options.worker is not None:
        work(options.only[0], options.worker, options.seed, options.score_every)
        return
    table.header()
    names = options.only or [one.name for one in ALL_TYPES]
    numbers = range(options.first, options.first + options.mutants)
    types = [one for one in ALL_TYPES if one.name in names]
    with tempfile.TemporaryDirectory(prefix="tcs-fuzz-") as folder:
        prepare(Path(folder), [one.file for one in types])
        for name in names:
            judge_all(name, numbers, options, Path(folder))
            # An interrupted run keeps the types that it has finished.
            table.save(options, keep=True)


def judge_all(name: str, numbers: range, options: argparse.Namespace, folder: Path) -> None:
    """Judge mutants of a type; print defects and a line of the table, and record it."""
    count: Counter[str] = Counter()
    slowest = (0.0, 0)
    for number, answer in answers_of(name, numbers, options, folder):
        outcome = answer["outcome"]
        count[outcome] += 1
        if outcome == "scored":
            count["pairs"] += int(answer["text"])
        slowest = max(slowest, (answer["seconds"], number))
        if outcome in DEFECTS and count[outcome] <= options.show:
            print(f"--- {outcome}: {name}, mutant {number}\n{answer['text']}", flush=True)
    shown = ", ".join(f"{count[outcome]} {outcome}" for outcome in OUTCOMES if count[outcome])
    slow = f"slowest {slowest[0]:.1f} s (mutant {slowest[1]})"
    table.row(name, f"{shown}; {count['pairs']} pairs re-checked; {slow}")
    count["accepted"] += count["scored"]
    table.cell("fuzz", name, "mutants", f"{len(numbers):,}")
    for outcome in OUTCOMES:
        table.cell("fuzz", name, outcome, f"{count[outcome]:,}")
    table.cell("fuzz", name, "pairs re-checked", f"{count['pairs']:,}")
    table.cell("fuzz", name, "slowest [s]", f"{slowest[0]:.1f}")


if __name__ == "__main__":
    main()
