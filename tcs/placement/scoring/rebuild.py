"""The job and scene of a score file, or of what was made from one, built from installed models."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from tcs.errors import SelectionError, StoreError, StoreMismatchError
from tcs.model.grid import Axis
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.constraints import recorded_constraints
from tcs.placement.scoring.job import Job, JobOptions, load_job, load_jobs
from tcs.placement.scoring.person import KEY as PERSON
from tcs.placement.scoring.person import recorded_person
from tcs.placement.store import ScoreFile, check_scene, files_of_arms

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
    return load_job(*_models(record), **_options(record))


def _models(record: Mapping[str, Any]) -> tuple[str, str, str]:
    """Return the references of task, environment and robot."""
    return record["task"], record["environment"], record["robot"]


def _options(record: Mapping[str, Any]) -> JobOptions:
    """Return what of the scene is scored."""
    return {"constraints": recorded_constraints(record), "person": recorded_person(record)}


def rebuild_scene(file: ScoreFile, *, meshes: bool = False) -> tuple[Job, Scene, LoweredScene]:
    """Return the job a file was scored from, its live scene, and that scene as arrays.

    Args:
        file: A score file.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreMismatchError: If the models differ from those the file was made from.
        SelectionError: If the file is of several arms or hands, each of which has a scene of its
            own.
    """
    if file.arms:
        raise SelectionError(
            f"This needs one arm, but the score file is of {' and '.join(file.arms)}. Score one "
            f"arm: tcs score {file.task['name']} --robot {file.metadata['robot']} --arms "
            f"{file.arms[0]}"
        )
    if file.hands:
        raise SelectionError(
            f"This needs goals of one hand, but those of '{file.task['name']}' name "
            f"{len(file.hands)}. Score a task of the goals of one hand; select, explain, map, "
            "picture, export and verify take those of several."
        )
    job, scene, lowered = _built(recorded_job(file.metadata), file.observed_axes, meshes)
    check_scene(file, lowered.digest())
    return job, scene, lowered


def rebuild_scenes(
    file: ScoreFile, *, meshes: bool = False
) -> tuple[tuple[Job, Scene, LoweredScene], ...]:
    """Return job, scene and arrays of each arm or hand of a file, one for a file without.

    Args:
        file: A score file.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreMismatchError: If the models differ from those the file was made from.
    """
    if not file.hands:
        return tuple(rebuild_scene(of_arm, meshes=meshes) for of_arm in files_of_arms(file))
    jobs = load_jobs(*_models(file.metadata), **_options(file.metadata))
    hands = [{**job.hand.to_json(), "goals": list(job.goal_numbers)} for job in jobs]
    if hands != [{key: entry[key] for key in hands[0]} for entry in file.hands]:
        raise StoreMismatchError(
            f"Scores of '{file.metadata['task']}' are of goals with other hands than those of the "
            "task now. Score it again; choosing from the file still works."
        )
    found = tuple(_built(job, file.observed_axes, meshes) for job in jobs)
    for number, (*_, lowered) in enumerate(found):
        check_scene(file, lowered.digest(), number)
    return found


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
    job, scene, lowered = _built(recorded_job(record), axes, meshes)
    if lowered.digest() != record["scene_digest"]:
        raise StoreMismatchError(
            f"The plan for '{record['task']}' was made from other models (scene "
            f"{record['scene_digest'][:12]}) than those installed now (scene "
            f"{lowered.digest()[:12]}). Plan again."
        )
    return job, scene


def _built(job: Job, observed: tuple[Axis, ...], meshes: bool) -> tuple[Job, Scene, LoweredScene]:
    # A file that was scored live has an observed state of its own.
    job = dataclasses.replace(job, observed=observed)
    scene = job.scene(meshes=meshes)
    return job, scene, job.lowered(scene)
