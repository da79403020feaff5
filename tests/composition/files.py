"""The kinds of score files, each of a few configurations and two or three goals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from tcs.files.paths import data_folder
from tests.environments import write_environment
from tests.exact import exact_content
from tests.two_arms import GRID as BETWEEN
from tests.two_arms import PAIR

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
Goals = list[dict[str, Any]]
Run = Callable[..., Any]
"""Runs `tcs` with words and returns its JSON."""

ROTATION = {"rotation_about": [1, 0, 0]}
CONE = {"cone": {"axis": [1, 0, 0], "half_angle_deg": 20}}


@dataclass(frozen=True)
class Arm:
    """A robot, and where it reaches some goals of shaving."""

    robot: str
    goals: tuple[int, ...]
    x: float
    y: float
    yaw: float
    """The middle of a grid of 3 x 3 x 2 base poses [m, m, deg]."""
    torso: float = 0.0

    def environment(self, folder: Path, **more: Any) -> Path:
        """Write the environment with the grid, and return its path."""
        grid = {
            "base_x": (self.x - 0.05, 0.05, 3),
            "base_y": (self.y - 0.05, 0.05, 3),
            "base_yaw": (self.yaw - 45.0, 45.0, 2),
            "torso": (self.torso, 0.15, 1),
        }
        return write_environment(folder, "few", grid, **more)


CLOSED = Arm("pr2", (0, 1, 2), 1.1, 0.7, 180.0, 0.3)
TRACED = Arm("xarm7", (0, 1, 5), 0.65, -0.6, 45.0)
SIX = Arm("ur5", (0, 1, 2), 1.0, 0.6, 45.0)
ELIMINATION = Arm("jaco", (0, 1, 2), 1.0, 0.6, 45.0)
STRETCH = Arm("stretch", (0, 5, 6), 0.7, -0.65, 180.0)


def exact(goals: Goals) -> Goals:
    """Leave the goals as they are."""
    return goals


def as_meant(goals: Goals) -> Goals:
    """Leave free what the shipped task does."""
    return goals


def free(region: Mapping[str, Any]) -> Callable[[Goals], Goals]:
    """Return the change that leaves something of each goal free."""
    return lambda goals: [{**goal, "free": dict(region)} for goal in goals]


def alternatives(goals: Goals) -> Goals:
    """Let either of two poses count: the second has the tool turned upside down."""
    found = []
    for goal in goals:
        w, x, y, z = goal["quaternion_wxyz"]
        # The product with a half turn about the tool's x axis.
        poses = [{"quaternion_wxyz": q} for q in ([w, x, y, z], [-x, w, z, -y])]
        rest = {key: value for key, value in goal.items() if key != "quaternion_wxyz"}
        found.append({**rest, "alternatives": poses})
    return found


def named(goals: Goals) -> Goals:
    """Give the first goal to the left arm and the others to the right one."""
    return [{**goal, "arm": "right" if n else "left"} for n, goal in enumerate(goals)]


def either_of_the_last(goals: Goals) -> Goals:
    """Give the first goal to the left arm, and leave the others to any."""
    return [{**goal, **({} if n else {"arm": "left"})} for n, goal in enumerate(goals)]


@dataclass(frozen=True)
class Kind:
    """A kind of score file."""

    arm: Arm
    change: Callable[[Goals], Goals] = exact
    words: Sequence[str] = ()
    """Further words of `tcs score`."""
    observed: Mapping[str, tuple[float, float, int]] | None = None
    """Axes that can only be observed, if there are any."""
    again: bool = False
    """Whether the file is scored twice, the second time from kept blocks."""
    seed_goals: Goals | None = field(default=None)
    """The goals, if they are not those of shaving."""

    def make(self, folder: Path, run: Run) -> Path:
        """Score a file of this kind in a folder, and return its path."""
        shaving = data_folder() / "tasks" / "adl" / "shaving.yaml"
        meant = self.change is as_meant
        task = yaml.safe_load(shaving.read_text()) if meant else exact_content("shaving")
        chosen = self.seed_goals or [task["goals"][goal] for goal in self.arm.goals]
        task |= {"name": "some", "goals": self.change(chosen)}
        path = folder / "some.yaml"
        path.write_text(yaml.safe_dump(task))
        environment = self.arm.environment(folder, observed=self.observed)
        return self.scored(folder, run, path, environment, self.arm.robot)

    def scored(self, folder: Path, run: Run, task: Path, environment: Path, robot: object) -> Path:
        """Score a task, and return the path of the file."""
        out = folder / "file.tcs"
        words = [
            "score", task, "--environment", environment, "--robot", robot, "--out", out,
            "--jobs", 1,            *self.words,
        ]  # fmt: skip
        if self.again:
            words += ["--blocks", folder / "blocks"]
            run(*words)
            out.unlink()
        run(*words)
        return out


class OnTheTable(Kind):
    """The arm of five joints of the examples, on a table, whose goals leave a rotation free."""

    def make(self, folder: Path, run: Run) -> Path:
        """Do as `Kind.make`."""
        task = yaml.safe_load((EXAMPLES / "feeding_from_any_side.yaml").read_text())
        task["goals"] = self.change(task["goals"][:3])
        path = folder / "some.yaml"
        path.write_text(yaml.safe_dump(task))
        environment = yaml.safe_load((EXAMPLES / "arm_on_the_table.yaml").read_text())
        grid = environment["grid"]
        grid["base_x"] |= {"count": 3}
        grid["base_y"] |= {"start": 0.12, "count": 3}
        grid["base_yaw"] |= {"start": 165, "count": 3}
        where = folder / "table.yaml"
        where.write_text(yaml.safe_dump(environment))
        return self.scored(folder, run, path, where, EXAMPLES / "so101.yaml")


class Between(Kind):
    """Two goals, each for an arm, beside the wheelchair."""

    def make(self, folder: Path, run: Run) -> Path:
        """Do as `Kind.make`."""
        task = {"name": "pair", "title": "Two arms", "source": "made up"}
        content = {**task, "environments": ["wheelchair"], "goals": self.change(PAIR)}
        path = folder / "pair.yaml"
        path.write_text(yaml.safe_dump(content))
        environment = write_environment(folder, "between", BETWEEN)
        return self.scored(folder, run, path, environment, "pr2")


def two_poses_of_the_first(goals: Goals) -> Goals:
    """Leave a rotation of the first goal free."""
    return [{**goal, **({} if n else {"free": ROTATION})} for n, goal in enumerate(goals)]


PERSON_Y = {"person_y": (0.0, 0.03, 2)}
_BOX = "0.1 0.1 0.1 at 2 2 0.05"

KINDS: dict[str, Kind] = {
    "seven joints, closed form": Kind(CLOSED),
    "seven joints, traced": Kind(TRACED),
    "six joints": Kind(SIX),
    "six joints, elimination": Kind(ELIMINATION),
    "five joints": OnTheTable(SIX),
    "slides (Stretch)": Kind(STRETCH),
    "as meant": Kind(CLOSED, as_meant),
    "as in the papers": Kind(CLOSED, as_meant, ("--paper",)),
    "free rotation": Kind(CLOSED, free(ROTATION)),
    "free cone": Kind(CLOSED, free(CONE)),
    "free rotation, traced": Kind(TRACED, free(ROTATION)),
    "free cone, six joints": Kind(SIX, free(CONE)),
    "free cone, slides": Kind(STRETCH, free(CONE)),
    "alternatives": Kind(CLOSED, alternatives),
    "alternatives, traced": Kind(TRACED, alternatives),
    "alternatives, elimination": Kind(ELIMINATION, alternatives),
    "either hand": Kind(CLOSED, exact, ("--arms", "both")),
    "either hand, free rotation": Kind(CLOSED, free(ROTATION), ("--arms", "both")),
    "named hands": Kind(CLOSED, named),
    "named hands, alternatives": Kind(CLOSED, lambda goals: alternatives(named(goals))),
    "two hands at once": Between(CLOSED),
    "two hands at once, free": Between(CLOSED, two_poses_of_the_first),
    "tool in the hand": Kind(CLOSED, exact, ("--tool", "razor")),
    "tool in the hand, elimination": Kind(ELIMINATION, exact, ("--tool", "razor")),
    "observed scene": Kind(CLOSED, exact, ("--observed", "person_y=0.02")),
    "observed scene, free rotation": Kind(SIX, free(ROTATION), ("--observed", "person_y=0.02")),
    "observed scene, either hand, resumed": Kind(
        CLOSED, exact, ("--arms", "both", "--observed", "person_y=0.02"), again=True
    ),
    "observed scene, refined": Kind(SIX, exact, ("--observed", "person_y=0.02", "--refine")),
    "observed axis": Kind(CLOSED, exact, (), PERSON_Y),
    "observed axis, either hand": Kind(CLOSED, exact, ("--arms", "both"), PERSON_Y),
    "constraints": Kind(
        STRETCH,
        exact,
        ("--forbid", "1.2 0.7, 1.4 0.7, 1.4 0.9, 1.2 0.9", "--only", "base_x <= 0.7 m"),
    ),
    "refined": Kind(TRACED, exact, ("--refine",)),
    "refined, either hand": Kind(CLOSED, exact, ("--refine", "--arms", "both")),
    "refined, free cone": Kind(SIX, free(CONE), ("--refine",)),
    "resumed": Kind(CLOSED, free(ROTATION), (), again=True),
}
"""Every kind of file, by what distinguishes it."""
