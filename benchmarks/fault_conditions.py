"""Run commands on machines that lack something, and count what goes wrong.

Usage: python benchmarks/fault_conditions.py [--flips 20] [--only NAME ...] [--seed 0]

Each command that writes a file runs with a full disk, too little memory, no home and a folder that
cannot be written; `tcs score` also beside another process with the same cold cache, with a Dask
worker that is killed, and with a bit of its machine code flipped. `--only` names some of these
conditions: disk, memory, home, folder, cold, dask, flips. Afterwards the same command must end its
work. Every count of a fault should be 0; the exit code is 1 if one is not.
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
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from table import cell, header, parser, row, save

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
CONDITIONS = {
    "disk": "files cannot grow (full disk)",
    "memory": "too little memory",
    "home": "no home",
    "folder": "folder that cannot be written",
    "cold": "two processes, one cold cache",
    "dask": "Dask worker killed",
    "flips": "a bit of the machine code flipped",
}
"""The conditions by the names of `--only`, and how the table calls them."""


def main() -> int:
    """Run every command under every condition and print the counts."""
    command_line = parser(__doc__)
    command_line.add_argument("--flips", type=int, default=20)
    command_line.add_argument("--only", nargs="*", choices=CONDITIONS, default=list(CONDITIONS))
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    faults = 0
    with tempfile.TemporaryDirectory() as above:
        folder = Path(above)
        environment, scores = small_scores(folder)
        (folder / "trials").mkdir()
        for name in options.only:
            found = counted(name, folder / "trials", environment, scores, options)
            title = CONDITIONS[name]
            row(title, ", ".join(f"{column} {found[column]}" for column in COLUMNS))
            for column in COLUMNS:
                cell("conditions", title, column, str(found[column]))
            faults += sum(found[fault] for fault in FAULTS)
            # An interrupted run keeps the conditions that it has finished.
            save(options, keep=True)
    return int(faults > 0)


def limited(kind: int, most: int) -> Callable[[], None]:
    """Return what sets a limit of a process before it starts."""
    return lambda: resource.setrlimit(kind, (most, most))


def counted(
    name: str, folder: Path, environment: Path, scores: Path, options: argparse.Namespace
) -> Counter[str]:
    """Return the counts of a condition.

    Args:
        name: One of `CONDITIONS`.
        folder: Folder for the trials.
        environment: A small environment.
        scores: Its scores, made without any condition.
        options: How many flipped bits, and the seed.
    """
    plain = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    commands = scoring_commands(environment, scores)
    if name == "cold":
        return cold_cache(folder / "cold", commands[0], plain, scores)
    if name == "dask":
        return killed_worker(folder / "dask", commands[0], plain, scores)
    counts: Counter[str] = Counter(dict.fromkeys(COLUMNS, 0))
    for command, variables, limits in trials_of(name, commands, plain, folder, options):
        with tempfile.TemporaryDirectory(dir=folder) as made:
            counts.update(
                tried(CONDITIONS[name], command, Path(made), variables, plain, scores, **limits)
            )
    return counts


def trials_of(
    name: str,
    commands: Sequence[Command],
    plain: dict[str, str],
    folder: Path,
    options: argparse.Namespace,
) -> Iterator[tuple[Command, dict[str, str], dict[str, Callable[[], None]]]]:
    """Yield command, variables and limits of each trial of a condition."""
    if name == "flips":
        for cache in islice(flipped_bits(folder / "flips", options.seed), options.flips):
            yield commands[0], {**plain, "TCS_CACHE_DIR": str(cache)}, {}
        return
    for command in commands:
        if name == "disk":
            for most in LIMIT_FILE:
                yield command, plain, {"preexec_fn": limited(resource.RLIMIT_FSIZE, most)}
        elif name == "memory":
            for most in LIMIT_MEMORY:
                limit = limited(resource.RLIMIT_AS, most * MEGABYTE)
                yield command, plain, {"preexec_fn": limit}
        elif name == "home":
            yield command, without_home(plain), {}
        else:
            yield command.writing_to(Path("/proc")), plain, {}


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
    counts: Counter[str] = Counter(dict.fromkeys(COLUMNS, 0))
    counts.update(judged("Dask", process.returncode, err))
    counts["files lost or half-written"] += not by_dask.is_old_or_new(folder)
    counts["left over"] += len(leftovers(folder, command))
    counts["other scores in the end"] += not ends_the_same(command, folder, plain, scores)
    return counts


if __name__ == "__main__":
    sys.exit(main())
