"""Run commands on machines that lack something, and count what goes wrong.

Usage: python benchmarks/fault_conditions.py [--flips 20] [--only NAME] [--seed 0]

Each command that writes a file runs with a full disk, too little memory, no home and a folder that
cannot be written; `tcs score` also beside another process with the same cold cache, with a Dask
worker that is killed, and with a bit of its machine code flipped. `--only` names one of these
conditions. Afterwards the same command must end its work. Every count of a fault should be 0; the
exit code is 1 if one is not.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path

from fault_commands import (
    CHECKOUT,
    Command,
    digest,
    leftovers,
    scoring_commands,
    small_scores,
)
from table import header, parser, record, row, save

from tcs.kernel.cache import jit_folder
from tcs.kernel.machine_code import private_folder

COLUMNS = (
    "tries",
    "done all the same",
    "one line",
    "files lost or half-written",
    "tracebacks or other lines",
    "left over",
    "other scores in the end",
)
"""Counts of each condition; the last four are faults."""

MEGABYTE = 1024**2
LIMIT_MEMORY = (500, 700, 900, 1200, 1600)
"""Address space of a process [MB]: from less than the imports take to enough."""
LIMIT_FILE = (4_000, 10_000, 30_000)
"""Largest file that can be written [bytes]: a disk that is full after so many. The semaphores of
joblib, which are files too, need some dozens."""
FAULTS = COLUMNS[3:]


def main() -> int:
    """Run every command under every condition and print the counts."""
    command_line = parser(__doc__)
    command_line.add_argument("--flips", type=int, default=20)
    command_line.add_argument("--only", choices=("commands", "cold", "dask", "flips"))
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    with tempfile.TemporaryDirectory() as above:
        folder = Path(above)
        environment, scores = small_scores(folder)
        found = conditions(folder / "trials", environment, scores, options)
    for name, counts in found.items():
        row(name, ", ".join(f"{column} {counts[column]}" for column in COLUMNS))
    rows = [[name, *(str(counts[c]) for c in COLUMNS)] for name, counts in found.items()]
    record("conditions", ["", *COLUMNS], rows)
    save(options)
    return int(any(counts[fault] for counts in found.values() for fault in FAULTS))


def limited(kind: int, most: int) -> Callable[[], None]:
    """Return what sets a limit of a process before it starts."""
    return lambda: resource.setrlimit(kind, (most, most))


def conditions(
    folder: Path, environment: Path, scores: Path, options: argparse.Namespace
) -> dict[str, Counter[str]]:
    """Return the counts of every condition, by its name.

    Args:
        folder: Folder to make for the trials.
        environment: A small environment.
        scores: Its scores, made without any condition.
        options: Which conditions, and how many flipped bits.
    """
    folder.mkdir()
    plain = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    commands = scoring_commands(environment, scores)
    found: dict[str, Counter[str]] = {}

    def count(name: str, command: Command, variables: Mapping[str, str], **limits: object) -> None:
        counts = found.setdefault(name, Counter(dict.fromkeys(COLUMNS, 0)))
        with tempfile.TemporaryDirectory(dir=folder) as made:
            ended = tried(name, command, Path(made), dict(variables), plain, scores, **limits)
            counts.update(ended)

    for command in commands if options.only in (None, "commands") else ():
        for most in LIMIT_FILE:
            limit = limited(resource.RLIMIT_FSIZE, most)
            count("files cannot grow (full disk)", command, plain, preexec_fn=limit)
        for most in LIMIT_MEMORY:
            limit = limited(resource.RLIMIT_AS, most * MEGABYTE)
            count("too little memory", command, plain, preexec_fn=limit)
        count("no home", command, without_home(plain))
        count("folder that cannot be written", command.writing_to(Path("/proc")), plain)
    if options.only in (None, "cold"):
        made = cold_cache(folder / "cold", commands[0], plain, scores)
        found["two processes, one cold cache"] = made
    if options.only in (None, "dask"):
        found["Dask worker killed"] = killed_worker(folder / "dask", commands[0], plain, scores)
    if options.only in (None, "flips"):
        for cache in islice(flipped_bits(folder / "flips", options.seed), options.flips):
            variables = {**plain, "TCS_CACHE_DIR": str(cache)}
            count("a bit of the machine code flipped", commands[0], variables)
    return found


def flipped_bits(folder: Path, seed: int) -> Iterator[Path]:
    """Yield again and again a cache folder whose machine code has one flipped bit."""
    code = jit_folder()
    assert code is not None
    rng = random.Random(seed)
    paths = sorted(path for path in code.iterdir() if path.is_file())
    sizes = [path.stat().st_size for path in paths]
    made = private_folder(folder / "jit") / code.name
    while True:
        # The copy of before was mended, by compiling again.
        shutil.rmtree(made, ignore_errors=True)
        shutil.copytree(code, made)
        (chosen,) = rng.choices(paths, sizes)
        content = bytearray(chosen.read_bytes())
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        (made / chosen.name).write_bytes(content)
        yield folder


def without_home(variables: Mapping[str, str]) -> dict[str, str]:
    """Return variables that name neither a home nor a folder for caches."""
    names = ("HOME", "TCS_CACHE_DIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME")
    return {name: value for name, value in variables.items() if name not in names}


def tried(
    condition: str,
    command: Command,
    folder: Path,
    variables: dict[str, str],
    plain: dict[str, str],
    scores: Path,
    **limits: object,
) -> Counter[str]:
    """Run a command under a condition and then without; return what was wrong."""
    temporary = folder / "tmp"
    temporary.mkdir()
    command.prepare(folder, scores)
    before = leftovers(folder, command)
    made = (command.elsewhere or folder) / command.out
    running = command.run(folder, {**variables, "TMPDIR": str(temporary)}, **limits)
    _, err = running.communicate()
    counts = Counter(judged(f"{command.name}, {condition}", running.returncode, err))
    counts["files lost or half-written"] += not command.is_old_or_new(folder)
    counts["left over"] += len(leftovers(folder, command) - before)
    is_other = running.returncode == 0 and command.scores and digest(made) != digest(scores)
    ends = ends_the_same(command, folder, plain, scores)
    counts["other scores in the end"] += is_other or not ends
    return counts


def judged(name: str, code: int, err: str) -> dict[str, int]:
    """Return the counts of how a process ended; print how, with its name, if that is a fault."""
    # Without a place for machine code every run compiles, and says so.
    lines = [line for line in err.splitlines() if not is_note(line)]
    fine = (code == 0 and not lines) or (code == 1 and len(lines) == 1)
    if not fine:
        print(f"    {name}, exit code {code}: {err[-600:]!r}", flush=True)
    return {
        "tries": 1,
        "done all the same": code == 0,
        "one line": code == 1 and len(lines) == 1,
        "tracebacks or other lines": not fine,
    }


def is_note(line: str) -> bool:
    """Return whether a line only says that code is compiled, or is not kept."""
    return "compiling for this" in line or "machine code" in line.lower()


def ends_the_same(command: Command, folder: Path, plain: dict[str, str], scores: Path) -> bool:
    """Return whether the command ends its work when nothing is missing any more."""
    again = command.writing_to(None)
    _, err = again.run(folder, plain).communicate()
    if not again.is_whole(folder):
        print(f"    {command.name}, afterwards: {err[-600:]!r}", flush=True)
        return False
    return not again.scores or digest(folder / again.out) == digest(scores)


def cold_cache(folder: Path, command: Command, plain: dict[str, str], scores: Path) -> Counter[str]:
    """Start two processes at once that have to compile into the same empty cache."""
    folder.mkdir()
    variables = {**plain, "TCS_CACHE_DIR": str(folder / "cache")}
    counts: Counter[str] = Counter(dict.fromkeys(COLUMNS, 0))
    folders = [folder / name for name in ("one", "two")]
    running = []
    for one in folders:
        (one / "tmp").mkdir(parents=True)
        running.append(command.run(one, {**variables, "TMPDIR": str(one / "tmp")}))
    for one, process in zip(folders, running, strict=True):
        _, err = process.communicate()
        counts.update(judged("cold cache", process.returncode, err))
        counts["files lost or half-written"] += not command.is_whole(one)
        counts["left over"] += len(leftovers(one, command))
        counts["other scores in the end"] += not ends_the_same(command, one, variables, scores)
    return counts


def killed_worker(
    folder: Path, command: Command, plain: dict[str, str], scores: Path
) -> Counter[str]:
    """Kill one of two Dask workers while they score."""
    from distributed import LocalCluster

    (folder / "tmp").mkdir(parents=True)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        words = ("--engine", "dask", "--scheduler", cluster.scheduler_address)
        by_dask = command.with_words(words)
        stop = threading.Event()

        def kill() -> None:
            """Kill a worker as soon as it has been sent work."""
            while not stop.wait(0.02):
                tasks = cluster.scheduler.tasks.values()
                if any(task.state == "processing" for task in tasks):
                    (nanny, *_) = cluster.workers.values()
                    if nanny.pid:
                        os.kill(nanny.pid, signal.SIGKILL)
                    return

        killer = threading.Thread(target=kill)
        killer.start()
        process = by_dask.run(folder, {**plain, "TMPDIR": str(folder / "tmp")})
        _, err = process.communicate()
        stop.set()
        killer.join()
    counts = Counter({**dict.fromkeys(COLUMNS, 0), **judged("Dask", process.returncode, err)})
    counts["files lost or half-written"] += not by_dask.is_old_or_new(folder)
    counts["left over"] += len(leftovers(folder, command))
    counts["other scores in the end"] += not ends_the_same(command, folder, plain, scores)
    return counts


if __name__ == "__main__":
    sys.exit(main())
