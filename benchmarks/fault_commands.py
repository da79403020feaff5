"""Commands that write files on a small scene, for benchmarks that interrupt or starve them."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

import tcs
from tcs.capability.map_files import load_map

CHECKOUT = Path(__file__).resolve().parents[1]
TCS = (sys.executable, "-m", "tcs")
GRID = {
    "base_x": ("m", 0.95, 0.1, 4),
    "base_y": ("m", -0.7, 0.7, 3),
    "base_yaw": ("deg", 90, 45, 4),
    "torso": ("m", 0.15, 0.15, 2),
}
"""96 configurations near a corner of the wheelchair: unit, start, step, count."""


def small_environment(folder: Path) -> Path:
    """Write the wheelchair on a small grid."""
    grid = {
        name: dict(zip(("unit", "start", "step", "count"), axis, strict=True))
        for name, axis in GRID.items()
    }
    path = folder / "corner.yaml"
    content = {"based_on": "wheelchair", "name": "corner", "title": "A corner", "grid": grid}
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


@dataclass(frozen=True)
class Command:
    """A command that writes a file.

    Attributes:
        name: Its name in the table.
        words: Its arguments; `{out}` is the file that it writes.
        out: Name of that file.
        keeps: Names of folders that it makes and keeps.
        elsewhere: Folder of the file; None for that in which the command runs.
        changes: Whether it changes a score file that is there.
        scores: Whether it writes the scores of the small environment.
    """

    name: str
    words: tuple[str, ...]
    out: str
    keeps: tuple[str, ...] = ()
    elsewhere: Path | None = None
    changes: bool = False
    scores: bool = False

    def writing_to(self, folder: Path | None) -> Command:
        """Return the command with its file in another folder, None for that in which it runs."""
        return dataclasses.replace(self, elsewhere=folder)

    def with_words(self, words: tuple[str, ...]) -> Command:
        """Return the command with further arguments."""
        return dataclasses.replace(self, words=(*self.words, *words))

    def prepare(self, folder: Path, scores: Path) -> None:
        """Write the score file that the command changes."""
        if self.changes:
            shutil.copy(scores, folder / self.out)

    def run(self, folder: Path, variables: dict[str, str], **limits: Any) -> subprocess.Popen[str]:
        """Start the command in a folder."""
        out = (self.elsewhere or folder) / self.out
        words = [word.format(out=out) for word in self.words]
        return subprocess.Popen(
            [*TCS, *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            env=variables,
            **limits,
        )

    def is_whole(self, folder: Path) -> bool:
        """Return whether the file it writes is complete."""
        path = folder / self.out
        try:
            if path.suffix == ".html":
                return path.read_text().rstrip().endswith("</html>")
            if path.suffix == ".icm":
                return load_map(path) is not None
            if path.suffix == ".png":
                return path.read_bytes()[-8:-4] == b"IEND"
            return bool(tcs.load(path).tables)
        except (OSError, tcs.TcsError):
            return False

    def is_old_or_new(self, folder: Path) -> bool:
        """Return whether the file is not there, or complete."""
        return self.is_whole(folder) or not (self.changes or (folder / self.out).exists())


def small_scores(folder: Path) -> tuple[Path, Path]:
    """Write a small environment and its scores into a folder."""
    environment = small_environment(folder)
    make = (
        "score",
        "shaving",
        "--paper",
        "--environment",
        str(environment),
        "--out",
        "{out}",
    )
    variables = {**os.environ, "PYTHONPATH": str(CHECKOUT)}
    Command("score", make, "scores.tcs").run(folder, variables).communicate()
    return environment, folder / "scores.tcs"


def scoring_commands(environment: Path, scores: Path) -> tuple[Command, ...]:
    """Return the commands that write files.

    Args:
        environment: A small environment.
        scores: Its scores.
    """
    make = ("score", "shaving", "--paper", "--environment", str(environment))
    samples = ("--samples", "64")
    people = ("--bodies", "6", "--sets", "2", "--map", "{out}")
    return (
        Command("score", (*make, "--out", "{out}"), "out.tcs", scores=True),
        Command(
            "score --blocks",
            (*make, "--blocks", "blocks", "--out", "{out}"),
            "out.tcs",
            keeps=("blocks",),
            scores=True,
        ),
        Command(
            "robustify", ("robustify", "{out}", "--sets", "40", *samples), "out.tcs", changes=True
        ),
        Command(
            "report",
            ("report", str(scores), "--out", "{out}", "--pairs", "20", "--dense", "5"),
            "out.html",
        ),
        Command(
            "capability from-ik",
            ("capability", "from-ik", "--out", "{out}", "--step", "0.2", "--yaw-bins", "8"),
            "out.icm",
        ),
        Command("population", ("population", str(scores), *people), "out.png"),
        Command(
            "robustify --blocks",
            ("robustify", "{out}", "--sets", "40", *samples, "--blocks", "blocks"),
            "out.tcs",
            keeps=("blocks",),
            changes=True,
        ),
        Command(
            "population --blocks",
            ("population", str(scores), *people, "--blocks", "blocks"),
            "out.png",
            keeps=("blocks",),
        ),
    )


def digest(path: Path) -> bytes:
    """Return a hash of the scores in a file."""
    table = tcs.load(path).nominal.scores
    arrays = (table.reason, table.dexterity, table.pair, table.arm_joints)
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).digest()


def leftovers(folder: Path, command: Command) -> set[Path]:
    """Return what is in the folder beside what the command writes."""
    kept = [path for name in command.keeps for path in (folder / name).rglob("*")]
    return {
        path
        for path in (*folder.iterdir(), *(folder / "tmp").iterdir(), *kept)
        if path.name
        not in (command.out, "tmp", "lock", "goals.json", "manifest.json", *command.keeps)
        and path.suffix != ".block"
        and not (path.is_dir() and path in kept)
    }
