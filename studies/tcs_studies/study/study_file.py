"""The plan of a study: `study.yaml` in its folder."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
import yaml
from pydantic import Field, StringConstraints, field_validator

from tcs.errors import DataFileError, OutputError, one_line
from tcs.files.documents import Document, JointPosition, Number, Position, checked, read_document
from tcs.files.writing import make_folder, whole_file
from tcs.model.robots import load_robot
from tcs.teleop.arm import Arm, load_arm, torso_height_of
from tcs.teleop.line import Course, Line
from tcs_studies.experiment.course import find_course
from tcs_studies.experiment.trial import CONDITIONS, TIME_LIMIT

STUDY_FILE = "study.yaml"
PARTICIPANTS, RUNS = "participants", "runs"
"""Folders of a study: files of participants, and runs of their trials."""
VERSION = 1
"""Version of the keys of `study.yaml`."""
Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9-]*$", max_length=40)]
"""Name of a condition, which is part of the names of run files."""
Title = Annotated[str, StringConstraints(min_length=1, max_length=80)]
Questionnaire = Literal["van-der-laan", "nasa-tlx", "difficulty"]
QUESTIONNAIRES: tuple[Questionnaire, ...] = get_args(Questionnaire)
"""Questionnaires after each condition."""
Limits = Literal["paper", "clamped"]
DRIVEN: dict[str, tuple[str, Limits]] = {
    **{one.name: (one.title, one.settings.limits) for one in CONDITIONS},
    "drake": ("Drake's differential inverse kinematics", "clamped"),
    "joint": ("joint set-points", "clamped"),
}
"""Title and behaviour at joint limits of the conditions that `tcs teleop` can drive."""
_MOST_CONDITIONS, _MOST_TRIALS = 8, 100


class LineEntry(Document):
    """The line, and the posture at its start."""

    start: tuple[Position, Position, Position]
    """Start in the robot's base [m]."""
    end: tuple[Position, Position, Position]
    """End in the robot's base [m]."""
    joints: Annotated[tuple[JointPosition, ...], Field(min_length=7, max_length=7)]
    """Start posture [rad]."""
    blocking_joint: Annotated[int, Field(strict=True, ge=1, le=7)]
    """Joint that meets its limit on the line, counted from 1."""


class ConditionEntry(Document):
    """A condition of the study: a controller, or any other difference between trials."""

    name: Name
    title: Title
    """Name that participants and readers see."""
    limits: Limits | None = None
    """Behaviour at joint limits in the live page; None for a condition that is driven elsewhere."""


class StudyFile(Document):
    """Content of `study.yaml`."""

    format_version: Literal[1]
    title: Title
    robot: Annotated[str, StringConstraints(min_length=1)]
    """Name or YAML file of the robot."""
    torso_height: Position
    """Height of the torso joint [m]."""
    line: LineEntry
    conditions: Annotated[list[ConditionEntry], Field(min_length=2, max_length=_MOST_CONDITIONS)]
    training: Annotated[int, Field(strict=True, ge=0, le=_MOST_TRIALS)]
    """Training trials with each condition."""
    trials: Annotated[int, Field(strict=True, ge=1, le=_MOST_TRIALS)]
    """Evaluated trials with each condition."""
    time_limit: Annotated[Number, Field(ge=1.0, le=3600.0)] = TIME_LIMIT
    """Time limit of a trial [s]."""
    participants: Annotated[int, Field(strict=True, ge=1, le=10_000)]
    """Planned number of participants."""
    questionnaires: tuple[Questionnaire, ...] = QUESTIONNAIRES
    """Questionnaires after each condition."""
    tlx_weights: Literal["each", "once"] = "each"
    """Whether the pairs of NASA-TLX are compared after each condition, or after the first one."""

    @field_validator("conditions")
    @classmethod
    def _each_once(cls, conditions: list[ConditionEntry]) -> list[ConditionEntry]:
        names = [one.name for one in conditions]
        if len({*names}) != len(names):
            raise ValueError(f"names must differ: {', '.join(names)}")
        return conditions


@dataclass(frozen=True, slots=True)
class Study:
    """A study: its folder, and its plan."""

    folder: Path
    plan: StudyFile

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the conditions."""
        return tuple(one.name for one in self.plan.conditions)

    @property
    def titles(self) -> dict[str, str]:
        """Titles of the conditions by name."""
        return {one.name: one.title for one in self.plan.conditions}

    @property
    def line(self) -> Line:
        """The line in the robot's base [m]."""
        return Line(self.plan.line.start, self.plan.line.end)

    @property
    def course(self) -> Course:
        """The line and the start posture."""
        entry = self.plan.line
        return Course(self.line, np.array(entry.joints), entry.blocking_joint - 1, ())

    def condition(self, name: str) -> ConditionEntry:
        """Return a condition by its name."""
        return next(one for one in self.plan.conditions if one.name == name)


def conditions_of(words: Sequence[str]) -> list[ConditionEntry]:
    """Return conditions from words such as "novel" or "stick=Joystick".

    A condition that `tcs teleop` can drive has its title unless another one is given.

    Raises:
        DataFileError: If a name or title is invalid, or a condition without a title is not one that
            `tcs teleop` can drive.
    """
    found = []
    for word in words:
        name, _, title = word.strip().partition("=")
        known = DRIVEN.get(name)
        if known is None and not title:
            raise DataFileError(
                f"condition '{one_line(name)}': `tcs teleop` drives {', '.join(DRIVEN)}. Give "
                "another one with its title, e.g. 'stick=Joystick', and its trials as run files."
            )
        limits = None if known is None else known[1]
        found.append({"name": name, "title": title or (known or ("",))[0], "limits": limits})
    return checked({"conditions": found}, _Conditions, "conditions", DataFileError).conditions


class _Conditions(Document):
    conditions: list[ConditionEntry]


def line_entry(course: Course) -> LineEntry:
    """Return a line for `study.yaml`."""
    return LineEntry(
        start=course.line.start,
        end=course.line.end,
        joints=tuple(float(q) for q in course.joints),
        blocking_joint=course.blocking + 1,
    )


def check_new(folder: Path) -> None:
    """Check that a folder has no study.

    Raises:
        OutputError: If it has one.
    """
    path = folder / STUDY_FILE
    if os.path.exists(path):
        raise OutputError(f"'{path}' exists. Name another folder, or continue that study.")


def create_study(folder: Path, plan: StudyFile) -> Study:
    """Write the plan of a study into a folder, which is made if it does not exist.

    Raises:
        OutputError: If the folder has a study, or cannot be written.
    """
    check_new(folder)
    path = folder / STUDY_FILE
    make_folder(folder / PARTICIPANTS)
    make_folder(folder / RUNS)
    content = yaml.safe_dump(plan.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    with whole_file(path, "Study") as stream:
        stream.write(content.encode())
    return Study(folder, plan)


def load_study(folder: Path) -> Study:
    """Return the study in a folder.

    Raises:
        DataFileError: If the folder has no study, or a value is missing or invalid.
        UnknownNameError: If a key is unknown.
    """
    path = folder / STUDY_FILE
    # A path that the operating system refuses has none either.
    if not os.path.exists(path):
        raise DataFileError(
            f"'{one_line(str(folder))}' has no {STUDY_FILE}. Give the folder of a study, or make "
            "one with `tcs study new`."
        )
    plan = read_document(path, StudyFile, f"study '{path}'", DataFileError)
    study = Study(folder, plan)
    # Raises where both ends are equal.
    _ = study.line
    return study


def check_arm(study: Study, arm: Arm) -> None:
    """Check that an arm is the one that the start posture of the line belongs to.

    Raises:
        TcsError: As `tcs_studies.experiment.trial.check_course`.
    """
    from tcs_studies.experiment.trial import check_course

    check_course(arm, study.course)


def new_study(
    folder: Path,
    plan: Mapping[str, Any],
    *,
    conditions: Sequence[str],
    line_seed: int = 0,
) -> Study:
    """Write the folder of a new study, and return it.

    Args:
        folder: The folder, made if it does not exist; it must not have a study.
        plan: Keys of `study.yaml` without format version, line and conditions; `torso_height` may
            be None for the middle of its range.
        conditions: Names such as "novel", or names with titles such as "stick=Joystick".
        line_seed: Seed of the search for the line.

    Raises:
        OutputError: If the folder has a study, or cannot be written.
        DataFileError: If a value or a condition is invalid.
        UnknownNameError: If the robot or a key is unknown.
        TcsError: If no line is found for the robot.
    """
    check_new(folder)
    entries = conditions_of(conditions)
    robot = load_robot(plan["robot"])
    arm = load_arm(robot, torso_height=torso_height_of(robot, plan["torso_height"]))
    content = {
        "format_version": VERSION,
        **plan,
        "torso_height": arm.torso_height,
        "line": line_entry(find_course(arm, line_seed)).model_dump(),
        "conditions": [one.model_dump() for one in entries],
    }
    return create_study(folder, checked(content, StudyFile, "study", DataFileError))
