"""The job and scene of a score file, or of what was made from one, built from installed models."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from tcs.errors import SelectionError, StoreError, StoreMismatchError
from tcs.model.grid import Axis
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.constraints import recorded_constraints
from tcs.placement.scoring.job import Job, load_job
from tcs.placement.scoring.person import KEY as PERSON
from tcs.placement.scoring.person import recorded_person
from tcs.placement.store import ScoreFile, check_scene

_MADE_FROM = ("task", "environment", "robot", "scene_digest")


def made_from(file: ScoreFile) -> dict[str, Any]:
    """Return what identifies the scene of a score file, as plain containers."""
    optional = [key for key in ("only", "constraints", PERSON) if key in file.metadata]
    return {
        **{key: file.metadata[key] for key in (*_MADE_FROM, *optional)},
        "observed": file.observed,
    }


def recorded_job(record: Mapping[str, Any]) -> Job:
    """Return the job that the metadata of a score file names, before its scene is built.

    Args:
        record: The metadata, or a record of `made_from`.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
    """
    return load_job(
        *(record[key] for key in ("task", "environment", "robot")),
        constraints=recorded_constraints(record),
        person=recorded_person(record),
    )


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
    job, scene, lowered = _rebuilt(file.metadata, file.observed_axes, meshes)
    check_scene(file, lowered.digest())
    return job, scene, lowered


def rebuild_made_from(record: Mapping[str, Any], *, meshes: bool = False) -> tuple[Job, Scene]:
    """Return the job and scene that a record of `made_from` identifies.

    Args:
        record: The record.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreError: If the record is incomplete.
        StoreMismatchError: If the models have changed since.
    """
    if not all(isinstance(record.get(key), str) for key in _MADE_FROM):
        raise StoreError(f"'made_from' must hold {', '.join(_MADE_FROM)}.")
    observed = record.get("observed", [])
    if not isinstance(observed, list) or not all(isinstance(axis, dict) for axis in observed):
        raise StoreError("'made_from' must hold 'observed' as a list of axes.")
    axes = tuple(Axis.from_dict(axis, where="observed") for axis in observed)
    job, scene, lowered = _rebuilt(record, axes, meshes)
    if lowered.digest() != record["scene_digest"]:
        raise StoreMismatchError(
            f"The plan for '{record['task']}' was made from other models (scene "
            f"{record['scene_digest'][:12]}) than those installed now (scene "
            f"{lowered.digest()[:12]}). Plan again."
        )
    return job, scene


def _rebuilt(
    record: Mapping[str, Any], observed: tuple[Axis, ...], meshes: bool
) -> tuple[Job, Scene, LoweredScene]:
    job = recorded_job(record)
    # A file that was scored live has an observed state of its own.
    job = dataclasses.replace(job, observed=observed)
    scene = job.scene(meshes=meshes)
    return job, scene, job.lowered(scene)
