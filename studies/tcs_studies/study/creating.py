"""Creation of a study: its line is searched for once, and all participants follow it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tcs.errors import DataFileError
from tcs.files.documents import checked
from tcs.model.robots import load_robot
from tcs.teleop.arm import load_arm, torso_height_of
from tcs_studies.experiment.course import find_course
from tcs_studies.study.study_file import (
    VERSION,
    Study,
    StudyFile,
    check_new,
    conditions_of,
    create_study,
    line_entry,
)


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
