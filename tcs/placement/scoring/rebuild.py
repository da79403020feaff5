"""The job and scene of a score file, built again from the installed models."""

from __future__ import annotations

import dataclasses

from tcs.errors import SelectionError
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.constraints import scored_constraints
from tcs.placement.scoring.job import Job, load_job
from tcs.placement.store import ScoreFile, check_scene


def rebuild_scene(file: ScoreFile, *, meshes: bool = False) -> tuple[Job, Scene, LoweredScene]:
    """Return the job a file was scored from, its live scene, and that scene as arrays.

    Args:
        file: A score file.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreMismatchError: If the models differ from those the file was made from.
        SelectionError: If the file is of several arms, each of which has a scene of its own.
    """
    if file.arms:
        raise SelectionError(
            f"This needs one arm, but the score file is of {' and '.join(file.arms)}. Score one "
            f"arm: tcs score {file.task['name']} --robot {file.metadata['robot']} --arms "
            f"{file.arms[0]}"
        )
    job = load_job(
        *(file.metadata[key] for key in ("task", "environment", "robot")),
        constraints=scored_constraints(file),
    )
    # A file that was scored live has an observed state of its own.
    job = dataclasses.replace(job, observed=file.observed_axes)
    scene = job.scene(meshes=meshes)
    lowered = job.lowered(scene)
    check_scene(file, lowered.digest())
    return job, scene, lowered
