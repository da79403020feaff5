"""Damage cached machine code and interrupt commands at random moments; count what goes wrong.

Usage: python benchmarks/faults.py [--flips 150] [--kernel-flips 20] [--signals 200] [--seed 0]

`--flips` damages one bit each in the machine code of small functions, `--kernel-flips` in that of
the kernel, which `tcs score` then has to compile again. `--signals` starts tcs score (also with
blocks), robustify, report, capability from-ik and population in turn and sends SIGINT, SIGTERM or
SIGKILL at a random moment (SIGKILL alone: `benchmarks/kills.py`). Every count of a fault should be
0; the exit code is 1 if one is not.
"""

from __future__ import annotations

import json
import logging
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from fault_commands import (
    CHECKOUT,
    Command,
    digest,
    leftovers,
    scoring_commands,
    small_environment,
    small_scores,
)
from numba.core.registry import CPUDispatcher
from table import header, parser, record, row, save

import tcs
from tcs.kernel import machine_code
from tcs.kernel.cache import jit, jit_folder

FAULTS = ("false results", "dead processes", "tracebacks", "not one warning", "not repaired")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGKILL)


def main() -> int:
    """Run every trial and print the counts."""
    command_line = parser(__doc__)
    command_line.add_argument("--flips", type=int, default=150)
    command_line.add_argument("--kernel-flips", type=int, default=20)
    command_line.add_argument("--signals", type=int, default=200)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    rng = random.Random(options.seed)
    faults = 0
    with tempfile.TemporaryDirectory() as above:
        folder = Path(above)
        lines = [
            ("bit flips, small functions", flips(folder / "small", options.flips, rng)),
            ("bit flips, the kernel", kernel_flips(folder / "kernel", options.kernel_flips, rng)),
        ]
        for name, found in lines:
            row(name, ", ".join(f"{key} {n}" for key, n in found.items()))
            faults += sum(found[fault] for fault in FAULTS)
        columns = ["", "tries", *FAULTS]
        record("bits", columns, [[n, *(f"{c[k]}" for k in columns[1:])] for n, c in lines])
        faults += signals(folder / "signals", options.signals, rng, SIGNALS)
    save(options)
    return 1 if faults else 0


def polynomial(x):
    """Return a value that a wrong constant or operation changes."""
    return ((1.5 * x - 2.25) * x + 3.75) * x - 0.125


def total(values):
    """Return a sum over an array, with a branch and a call of numpy."""
    found = 0.0
    for value in values:
        found += np.sqrt(value) if value > 0.5 else -value
    return found


def sorted_pair(first, second):
    """Return two numbers in order."""
    return (first, second) if first < second else (second, first)


CALLS = (
    (polynomial, (1.25,)),
    (total, (np.linspace(0.0, 1.0, 17),)),
    (sorted_pair, (3, 2)),
)


def flips(folder: Path, tries: int, rng: random.Random) -> Counter[str]:
    """Damage the machine code of small functions, one bit each time."""
    os.environ["TCS_CACHE_DIR"] = str(folder)
    jit_folder.cache_clear()
    plain = [function(*arguments) for function, arguments in CALLS]
    # As they come back from a child: without tuples.
    expected = json.loads(json.dumps(plain))
    counts: Counter[str] = Counter(dict.fromkeys(("tries", *FAULTS), 0))
    if answers_of_a_child() != (expected, 0, []):
        raise RuntimeError("the functions give false results without any damage")
    for _ in range(tries):
        counts["tries"] += 1
        files = sorted((folder / "jit").rglob("*.nbc"))
        path = rng.choice(files)
        flip(path, rng)
        counts.update(judged(answers_of_a_child(), expected, len(CALLS) - 1))
        again = answers_of_a_child()
        if again != (expected, len(CALLS), []):
            counts["not repaired"] += 1
    del os.environ["TCS_CACHE_DIR"]
    jit_folder.cache_clear()
    return counts


def answers_of_a_child() -> tuple[object, int, list[str]] | str:
    """Return results, loaded functions and warnings of a fork of this process, or how it ended."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        with os.fdopen(writing, "w") as stream:
            try:
                json.dump(answers(), stream)
            except BaseException:
                stream.write("\n" + traceback.format_exc())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as stream:
        text = stream.read()
    _, status = os.waitpid(child, 0)
    if status:
        return "dead processes"
    try:
        results, loaded, warnings = json.loads(text)
    except ValueError:
        return "tracebacks"
    return results, loaded, warnings


def answers() -> tuple[list[object], int, list[str]]:
    """Compile or load each function; return its results, how many were loaded, and the warnings."""
    warnings: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda entry: warnings.append(entry.getMessage())  # type: ignore[method-assign]
    logging.getLogger(machine_code.__name__).addHandler(handler)
    results, loaded = [], 0
    for function, arguments in CALLS:
        compiled = jit(function)
        if not isinstance(compiled, CPUDispatcher):
            raise TypeError("numba is disabled")
        results.append(compiled(*arguments))
        loaded += sum(compiled.stats.cache_hits.values())
    return results, loaded, warnings


def judged(
    found: tuple[object, int, list[str]] | str, expected: list[object], loaded: int
) -> Counter[str]:
    """Return which fault a run with one damaged file shows, if any."""
    if isinstance(found, str):
        return Counter({found: 1})
    results, hits, warnings = found
    return Counter(
        {
            # The damaged file itself must not have been loaded.
            "false results": int(results != expected or hits != loaded),
            "not one warning": int(len(warnings) != 1),
        }
    )


def flip(path: Path, rng: random.Random) -> None:
    """Flip one random bit of a file."""
    content = bytearray(path.read_bytes())
    bit = rng.randrange(8 * len(content))
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


LISTING = """
import sys
from tcs.kernel.machine_code import CodeFiles
load = CodeFiles.load
def listed(self, key):
    print(self.path(key), file=sys.stderr)
    return load(self, key)
CodeFiles.load = listed
"""


def kernel_flips(folder: Path, tries: int, rng: random.Random) -> Counter[str]:
    """Damage machine code that `tcs score` loads, one bit each time, and score."""
    counts: Counter[str] = Counter(dict.fromkeys(("tries", *FAULTS), 0))
    if not tries:
        return counts
    folder.mkdir()
    environment = small_environment(folder)
    variables = {**os.environ, "PYTHONPATH": str(CHECKOUT), "TCS_CACHE_DIR": str(folder / "cache")}

    def scored(before: str = "") -> tuple[object, list[str]] | str:
        path = folder / "scores.tcs"
        program = f"{before}\nfrom tcs.cli import main\nmain()"
        words = ("score", "shaving", "--environment", environment, "--paper")
        words += ("--out", path, "--json")
        done = subprocess.run(
            [sys.executable, "-c", program, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            env=variables,
        )
        if done.returncode < 0:
            return "dead processes"
        if done.returncode:
            return "tracebacks"
        lines = [line for line in done.stderr.splitlines() if "compiling for this" not in line]
        scores = tcs.load(path).nominal.scores
        content = [scores.reason.tolist(), scores.dexterity.tolist(), scores.arm_joints.tolist()]
        return content, lines

    first = scored()
    listing = scored(LISTING)
    if isinstance(first, str) or isinstance(listing, str):
        raise RuntimeError(f"scoring does not run: {first}")
    expected = first[0]
    paths = sorted({Path(line) for line in listing[1] if Path(line).exists()})
    pristine = {path: path.read_bytes() for path in paths}
    row("files that scoring loads", f"{len(paths)}, {sum(map(len, pristine.values())):,} bytes")
    for _ in range(tries):
        counts["tries"] += 1
        path = rng.choice(paths)
        flip(path, rng)
        found = scored()
        if isinstance(found, str):
            counts[found] += 1
            path.write_bytes(pristine[path])
            continue
        counts["false results"] += int(found[0] != expected)
        counts["not one warning"] += int(len(found[1]) != 1)
        again = scored()
        counts["not repaired"] += int(again != (expected, []))
    return counts


SIGNAL_COLUMNS = (
    "tries",
    "ended by the signal",
    "files lost or half-written",
    "tracebacks or other lines",
    "other exit codes",
    "left by SIGINT or SIGTERM",
    "left by SIGKILL",
    "still there after the next run",
    "other scores in the end",
)


def signals(folder: Path, tries: int, rng: random.Random, numbers: Sequence[signal.Signals]) -> int:
    """Interrupt commands at random moments; return the number of faults."""
    if not tries:
        return 0
    folder.mkdir()
    environment, scores = small_scores(folder)
    variables = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    commands = scoring_commands(environment, scores)
    rows, faults = [], 0
    for number, command in enumerate(commands):
        share = tries // len(commands) + (number < tries % len(commands))
        found = interrupted(command, folder / str(number), share, variables, scores, rng, numbers)
        row(f"signals, {command.name}", ", ".join(f"{k} {found[k]}" for k in SIGNAL_COLUMNS))
        rows.append([command.name, *(str(found[column]) for column in SIGNAL_COLUMNS)])
        faults += sum(found[column] for column in (*SIGNAL_COLUMNS[2:6], *SIGNAL_COLUMNS[7:]))
    record("signals", ["", *SIGNAL_COLUMNS], rows)
    return faults


def interrupted(
    command: Command,
    folder: Path,
    tries: int,
    variables: dict[str, str],
    scores: Path,
    rng: random.Random,
    numbers: Sequence[signal.Signals],
) -> Counter[str]:
    """Interrupt one command at random moments between its start and its end."""
    counts: Counter[str] = Counter()
    temporary = folder / "tmp"
    temporary.mkdir(parents=True)
    variables = {**variables, "TMPDIR": str(temporary)}
    command.prepare(folder, scores)
    begun = time.perf_counter()
    _, err = command.run(folder, variables).communicate()
    duration = time.perf_counter() - begun
    if not command.is_whole(folder):
        raise RuntimeError(f"{command.name} does not run: {err}")
    for _ in range(tries):
        number, left = rng.choice(numbers), leftovers(folder, command)
        running = command.run(folder, variables)
        time.sleep(rng.uniform(0.0, duration))
        running.send_signal(number)
        _, err = running.communicate()
        counts["tries"] += 1
        counts["ended by the signal"] += running.returncode != 0
        counts["files lost or half-written"] += not command.is_whole(folder)
        ending = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}[number]
        # After its work is done, the system's own action may end a process.
        counts["other exit codes"] += running.returncode not in (0, ending, -number)
        is_reported = running.returncode in (130, 143)
        lines = [line for line in err.splitlines() if "compiling for this" not in line]
        if len(lines) != int(is_reported):
            counts["tracebacks or other lines"] += 1
            row("", f"{command.name}, {number.name}, exit code {running.returncode}: {err!r}")
        new = leftovers(folder, command) - left
        counts["left by SIGKILL" if number == signal.SIGKILL else "left by SIGINT or SIGTERM"] += (
            len(new)
        )
    command.run(folder, variables).communicate()
    if command.scores:
        counts["other scores in the end"] += digest(folder / command.out) != digest(scores)
    counts["still there after the next run"] = len(leftovers(folder, command))
    return counts


if __name__ == "__main__":
    sys.exit(main())
