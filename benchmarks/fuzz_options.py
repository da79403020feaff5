"""Give every option and argument of every command odd values, and count what becomes of them.

A call ends with exit code 0, is refused in one line (1) or is misuse (2). A refusal leaves no file
behind, and no call ends in a traceback, a dead process or a hang; anything else is a defect.

    python benchmarks/fuzz_options.py --save
    python benchmarks/fuzz_options.py --only "capability show" --list
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import stat
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import table
from fuzz_files import FILE_TYPES, prepare
from fuzz_further_files import write_bag
from worker import Worker

SECONDS = 300.0
"""Most processor time for one call [s]; an experiment with another line takes 15 s."""

NUMBERS = ("0", "-0.0", "-1", "nan", "inf", "-inf", "1e308", "1e-300", "1e400", "", "x", "1,5")
INTEGERS = ("0", "-1", "2147483648", "9" * 23, "9" * 5000, "nan", "1.5", "1e3", "", "x", "٣")
TEXTS = (
    *("", " ", "nonsense", "a" * 5000, f"{'a' * 250}.yaml", "a/b/c", "~unknown-user/x", "a\0b"),
    *("é\u2028", "\udcff", "two\nlines", "%s%n{x}", "-", "=", "=1", "x=nan", "x=1e308", "base_x=1"),
    *(
        "head=nan,0,0",
        "top=0,0,0",
        ".",
        "folder",
        "pipe",
        "loop",
        "absent/x.html",
        "empty",
        "noise",
    ),
    *("scores.tcs", "map.tcm", "run.csv", "task.yaml", "mesh.obj", "iiwa7.urdf", "absent.csv"),
)
CACHES = ("", "~unknown-user/x", "a" * 5000, "noise", "pipe", "loop", "noise/x", "é\u2028", ".")
"""Values of TCS_CACHE_DIR."""

OUTCOMES = (
    *("done", "refused", "misuse", "traceback", "abort", "hang"),
    *("not one line", "other exit code", "file left"),
)
DEFECTS = OUTCOMES[3:]


@dataclass(frozen=True)
class Command:
    """A command and the words with which it runs quickly.

    Attributes:
        name: Its name, such as "capability show".
        arguments: Values of its arguments.
        options: Its options.
        only: Options to which odd values are given; empty for all.
        is_refused: Whether these words are refused, since the example lacks what they need; odd
            values must end in a line nevertheless.
    """

    name: str
    arguments: tuple[str, ...] = ()
    options: tuple[str, ...] = ()
    only: tuple[str, ...] = ()
    is_refused: bool = False

    @property
    def words(self) -> tuple[str, ...]:
        """The words with which it runs."""
        return (*self.name.split(), *self.arguments, *self.options)


_THREE = ("--environment", "kitchen.yaml", "--robot", "iiwa7.yaml")
_PICK = ("--task", "pick-and-place")
_GRID = ("--step", "0.4", "--yaw-bins", "4")
_SMALL_MAP = (*_GRID, "--out", "out.tcm")
_WINDOW = ("--no-browser", "--duration", "0")
COMMANDS = (
    Command("list"),
    Command("score", ("task.yaml",), (*_THREE, "--out", "out.tcs", "--jobs", "1")),
    Command("select", ("scores.tcs",), ("--here", "0", "0", "0")),
    Command("explain", ("scores.tcs",), ("--goal", "1")),
    Command("verify", ("scores.tcs",), ("--pairs", "2", "--dense", "0", "--jobs", "1")),
    Command("export", ("scores.tcs",), ("--out", "out.csv")),
    Command("evaluate", ("scores.tcs",), ("--samples", "4", "--jobs", "1")),
    Command(
        "robustify",
        ("scores.tcs",),
        ("--samples", "4", "--sets", "2", "--jobs", "1", "--out", "out.tcs"),
    ),
    Command("population", ("scores.tcs",), ("--bodies", "2", "--sets", "2", "--jobs", "1")),
    Command("refine", ("scores.tcs",), ("--starts", "1", "--rounds", "1", "--out", "out.tcs")),
    Command("check", ("scores.tcs", "map.tcm")),
    Command("environment check", ("kitchen.yaml",)),
    Command("new environment", ("new.yaml",)),
    Command("new task", ("new.yaml",)),
    Command("app", ("scores.tcs",), _WINDOW),
    # Refused whatever the options are, so that none of the calls listens.
    Command("serve", ("none.tcs",), ("--host", "0.0.0.0"), is_refused=True),
    Command("view", ("scores.tcs",), ("--export", "out.html")),
    Command("view", ("scores.tcs",), _WINDOW, ("--port", "--duration")),
    Command("map", ("scores.tcs",), ("--out", "out.png")),
    Command("picture", ("scores.tcs",), ("--out", "out.png")),
    Command("report", ("scores.tcs",), ("--out", "out.html", "--pairs", "2", "--dense", "0")),
    Command("map-check", ("ik.tcm",), ("--queries", "5", "--jobs", "1")),
    Command(
        "map-check",
        (),
        ("--robot", "iiwa7", *_GRID, "--radius", "0.8", "--queries", "5", "--jobs", "1"),
        ("--torso-height", "--step", "--yaw-bins", "--tool", "--robot", "--grasps", "--radius"),
    ),
    Command("robot new", ("iiwa7.urdf",), ("--tool", "iiwa_link_ee_kuka", "--out", "out.yaml")),
    Command("robot check", ("iiwa7.yaml",), ("--samples", "2")),
    Command(
        "capability from-ik",
        (),
        ("--robot", "iiwa7", "--type", "ICM", "--radius", "0.8", *_SMALL_MAP, "--jobs", "1"),
    ),
    Command("capability record", ("recording.csv",), ("--robot", "pr2", *_SMALL_MAP)),
    Command(
        "capability record",
        (),
        ("--robot", "pr2", "--seconds", "2", *_SMALL_MAP),
        ("--seconds", "--scale", "--centre", "--seed", "--save-csv"),
    ),
    Command("capability from-bag", ("arm.bag",), ("--robot", "pr2", *_SMALL_MAP)),
    Command("capability merge", ("map.tcm",), (*_PICK, "--height", "0.41")),
    Command(
        "capability merge",
        ("ik.tcm",),
        ("--task", "curved", "--height", "1.0", "--length", "0.4", "--samples", "1"),
        ("--length", "--samples", "--start-deg", "--end-deg"),
    ),
    Command(
        "capability merge",
        ("ik.tcm",),
        (*_PICK, "--height", "1.0", "--length", "0.8", "--environment", "kitchen.yaml"),
        ("--environment", "--task-at", "--robot"),
    ),
    Command("capability show", ("map.tcm",), ("--out", "out.png", "--tilt", "9")),
    Command(
        "arplace learn",
        (),
        (
            *("--distances", "0.1", "0.1", "2", "--heights", "0.5", "0.1", "1", "--jobs", "1"),
            *("--base-x", "-0.8", "0.1", "6", "--base-y", "-0.5", "0.2", "6", "--out", "out.arp"),
        ),
    ),
    Command("arplace query", ("model.arp",), ("--std", "0.05", "--samples", "20")),
    Command("arplace merge", ("map.apm",)),
    Command("arplace show", ("model.arp",)),
    Command("plan", ("scores.tcs",)),
    Command("motions", ("scores.tcs",), ("--most", "2", "--jobs", "1")),
    Command("locate", (), ("--table-at", "1.2", "0.3", "10", "--scans", "2")),
    Command("study new", ("out",)),
    Command("study record", ("study",), _WINDOW),
    Command("study report", ("study",), is_refused=True),
    Command("teleop", (), _WINDOW),
    Command("teleop replay", ("run.csv",), ("--export", "out.html")),
    Command("teleop replay", ("run.csv",), _WINDOW, ("--port", "--duration")),
    Command("teleop work", ("run.csv",), is_refused=True),
    Command(
        "teleop pick-and-place",
        (),
        (
            *("--operators", "2", "--repetitions", "1", "--training", "0", "--jobs", "1"),
            *("--condition", "ITCM-high", "--out", "out"),
        ),
    ),
    Command(
        "teleop experiment",
        (),
        ("--operators", "3", "--trials", "1", "--training", "0", "--jobs", "1", "--out", "out"),
    ),
)


@dataclass(frozen=True)
class Call:
    """Words of one call, and the folder of the cache if it is an odd one."""

    words: tuple[str, ...]
    cache: str | None = None

    @property
    def shown(self) -> str:
        """The call as one line."""
        words = " ".join(
            ascii(word) if len(word) < 60 else f"'{word[:9]}...'" for word in self.words
        )
        return words if self.cache is None else f"TCS_CACHE_DIR={self.cache[:60]!r} {words}"


@cache
def command_line() -> Any:
    """Return the whole command line."""
    from typer.main import get_command

    from tcs.cli.app import app

    return get_command(app)


def click_command(name: str) -> Any:
    """Return a command of the command line."""
    found = command_line()
    for word in name.split():
        found = found.commands[word]
    return found


def command_names() -> list[str]:
    """Return the names of all commands, of several names of one that of `COMMANDS`."""
    known = {command.name for command in COMMANDS}
    names: dict[Any, str] = {}
    waiting: list[tuple[str, Any]] = [("", command_line())]
    while waiting:
        name, found = waiting.pop(0)
        inner = getattr(found, "commands", {})
        if name and (not inner or found.invoke_without_command):
            function = found.callback.__wrapped__
            if function not in names or name in known:
                names[function] = name
        waiting += [(f"{name} {word}".strip(), one) for word, one in inner.items()]
    return list(names.values())


def odd_values(parameter: Any) -> tuple[str, ...]:
    """Return odd values for an option or argument, by its type."""
    annotation = str(parameter.type_descriptor.annotation)
    return NUMBERS if "float" in annotation else INTEGERS if "int" in annotation else TEXTS


def calls(command: Command) -> Iterator[Call]:
    """Yield the calls of a command with one odd value each."""
    name = command.name.split()
    arguments = 0
    for parameter in click_command(command.name).params:
        if parameter.name == "help":
            continue
        is_argument = parameter.param_type_name == "argument"
        arguments += is_argument
        if command.only and parameter.opts[0] not in command.only:
            continue
        if not is_argument and parameter.is_flag:
            yield Call((*command.words, parameter.opts[0]))
            continue
        for value in odd_values(parameter):
            if is_argument:
                given = [*command.arguments]
                given[arguments - 1 :] = [value]
                yield Call((*name, *command.options, "--", *given))
            else:
                # The later one of two options counts.
                yield Call((*command.words, parameter.opts[0], *[value] * max(parameter.nargs, 1)))
    if command.name in ("score", "robot check"):
        for cache in CACHES:
            yield Call(command.words, cache)


def make_map(folder: Path) -> None:
    """Write a coarse map made by inverse kinematics."""
    from tcs.capability import MapGrid, Reach, map_from_ik, save_map

    reach = Reach.load("iiwa7", step=0.4)
    grid = MapGrid.of(0.4, 4, "all")
    save_map(folder / "ik.tcm", map_from_ik(reach, grid, map_type="ICM", radius=0.8))


def make_bag(folder: Path) -> None:
    """Write a bag of ROS 1 with the joint states of the recording."""
    names, *rows = (folder / "recording.csv").read_text(encoding="utf-8").splitlines()
    states = np.array([row.split(",") for row in rows[:20]], dtype=np.float64)
    write_bag(folder / "arm.bag", names.split(","), states)


def make_study(folder: Path) -> None:
    """Write the plan of a study, which `make_odd_files` puts in a folder of its own."""
    from tcs_studies.study.study_file import new_study

    plan = {
        **{"title": "Study", "robot": "iiwa7", "torso_height": None, "training": 0, "trials": 1},
        **{"time_limit": 60.0, "participants": 2},
    }
    with tempfile.TemporaryDirectory() as made:
        study = new_study(Path(made, "study"), plan, conditions=("end-effector", "novel"))
        shutil.copy(study.folder / "study.yaml", folder)


def make_odd_files(folder: Path) -> None:
    """Write what is no file of `tcs`: folders, a pipe, a loop, an empty file and random bytes."""
    (folder / "folder").mkdir()
    (folder / "study").mkdir()
    shutil.copy(folder / "study.yaml", folder / "study")
    os.mkfifo(folder / "pipe")
    (folder / "loop").symlink_to("loop")
    (folder / "empty").write_bytes(b"")
    (folder / "noise").write_bytes(bytes(range(128, 256)) * 8)


class Folder:
    """The working folder of a process, which is restored after each call."""

    def __init__(self, path: Path) -> None:
        """Remember the content of the folder."""
        self._path = path
        self._content = {one: one.read_bytes() for one in path.iterdir() if one.is_file()}
        self._state = self._now()

    def _now(self) -> dict[Path, tuple[int, ...]]:
        found = {}
        for path in self._path.rglob("*"):
            status = path.lstat()
            held = (status.st_size, status.st_mtime_ns) if stat.S_ISREG(status.st_mode) else ()
            found[path] = (status.st_mode, *held)
        return found

    def changes(self) -> list[str]:
        """Return the names of what has been added, changed or removed."""
        now = self._now()
        paths = {*now, *self._state}
        return sorted(path.name for path in paths if now.get(path) != self._state.get(path))

    def restore(self) -> None:
        """Bring the folder back to what it was."""
        for path in self._path.iterdir():
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()
        for path, content in self._content.items():
            path.write_bytes(content)
        make_odd_files(self._path)
        self._state = self._now()


def outcome_of(code: int, err: str, changes: list[str]) -> tuple[str, str]:
    """Return what has become of a call: one of OUTCOMES, and the message.

    Args:
        code: Exit code.
        err: What it wrote to stderr.
        changes: Names of the files that it wrote or removed.
    """
    lines = [line for line in err.splitlines() if "compiling for this machine" not in line]
    shown = err.strip()[-500:]
    if "Traceback (most recent" in err or "Warning:" in err:
        return "traceback", err[-3000:]
    parts = [name for name in changes if name.endswith(".part")]
    if code == 0:
        return ("file left", f"{parts}") if parts else ("done", "")
    if changes:
        return "file left", f"{changes} after {shown}"
    if code == 2:
        text = [line.strip("│ ") for line in lines if line.startswith("│")]
        return ("misuse", " ".join(text)) if text else ("not one line", shown)
    if code != 1:
        return "other exit code", f"{code}: {shown}"
    if len(lines) != 1 or not lines[0].startswith("tcs: "):
        return "not one line", shown
    return "refused", lines[0]


def judged(call: Call, folder: Folder) -> tuple[str, str]:
    """Run a call in this process, whose stderr is a file."""
    from tcs.cli import main
    from tcs.kernel.cache import jit_folder

    sys.argv = ["tcs", *call.words]
    if call.cache is not None:
        os.environ["TCS_CACHE_DIR"] = call.cache
        jit_folder.cache_clear()
    os.ftruncate(2, 0)
    os.lseek(2, 0, os.SEEK_SET)
    code, failure = 0, ""
    try:
        main()
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:
        failure = traceback.format_exc()[-3000:]
    finally:
        if call.cache is not None:
            del os.environ["TCS_CACHE_DIR"]
            jit_folder.cache_clear()
    sys.stdout.flush()
    sys.stderr.flush()
    written = os.pread(2, 100_000, 0).decode(errors="replace")
    changes = folder.changes()
    if changes:
        folder.restore()
    if failure:
        return "traceback", failure
    return outcome_of(code, written, changes)


def work(place: Path) -> None:
    """Judge the calls that arrive on stdin; print one line of JSON for each."""
    answers = os.fdopen(os.dup(1), "w")
    questions = os.fdopen(os.dup(0))
    with tempfile.TemporaryFile() as log:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(log.fileno(), 2)
        os.chdir(place)
        make_odd_files(place)
        folder = Folder(Path())
        print("ready", file=answers, flush=True)
        for line in questions:
            words, cache = json.loads(line)
            begun = time.perf_counter()
            outcome, text = judged(Call(tuple(words), cache), folder)
            answer = {"outcome": outcome, "text": text, "seconds": time.perf_counter() - begun}
            print(json.dumps(answer), file=answers, flush=True)


def main() -> int:
    """Call every command and print a table; the exit code is 1 if there is a defect."""
    command_line = table.parser(__doc__ or "")
    command_line.add_argument("--only", nargs="*", help="names of commands, by default all")
    command_line.add_argument(
        "--list", action="store_true", help="print every call and its outcome"
    )
    command_line.add_argument("--worker", type=Path, help=argparse.SUPPRESS)
    options = command_line.parse_args()
    if options.worker is not None:
        work(options.worker)
        return 0
    table.header()
    counts: dict[str, Counter[str]] = {}
    slowest: dict[str, float] = {}
    with tempfile.TemporaryDirectory(prefix="tcs-fuzz-") as folder:
        prepare(Path(folder), [one.file for one in FILE_TYPES])
        make_map(Path(folder))
        make_bag(Path(folder))
        make_study(Path(folder))
        worker = Worker(Path(__file__), (), Path(folder), SECONDS)
        for command in COMMANDS:
            if options.only and command.name not in options.only:
                continue
            count = counts.setdefault(command.name, Counter())
            found = worker.judge([command.words, None])
            if found["outcome"] != ("refused" if command.is_refused else "done"):
                raise SystemExit(f"'{' '.join(command.words)}' does not run: {found['text']}")
            for call in calls(command):
                answer = worker.judge([call.words, call.cache])
                outcome, seconds = answer["outcome"], answer["seconds"]
                count[outcome] += 1
                slowest[command.name] = max(slowest.get(command.name, 0.0), seconds)
                if outcome in DEFECTS:
                    print(f"--- {outcome}: {call.shown}\n{answer['text']}", flush=True)
                elif options.list:
                    print(f"{outcome:<8} {seconds:5.2f} s  {call.shown}: {answer['text']}")
            shown = ", ".join(f"{count[o]} {o}" for o in OUTCOMES if count[o])
            table.row(command.name, f"{shown}; slowest {slowest[command.name]:.1f} s")
        worker.close()
    for name, count in counts.items():
        table.cell("options", name, "calls", f"{count.total():,}")
        for outcome in OUTCOMES:
            table.cell("options", name, outcome, f"{count[outcome]:,}")
    total = sum(counts.values(), Counter[str]())
    table.row("all", ", ".join(f"{total[o]} {o}" for o in OUTCOMES if total[o]))
    table.save(options)
    return 1 if any(total[outcome] for outcome in DEFECTS) else 0


if __name__ == "__main__":
    sys.exit(main())
