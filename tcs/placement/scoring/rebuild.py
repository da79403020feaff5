"""The job and scene of a score file, or of what was made from one, built from installed models."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from tcs.errors import StoreError, StoreMismatchError
from tcs.model.grid import Axis
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.constraints import recorded_constraints
from tcs.placement.scoring.hands import digest_of_hands
from tcs.placement.scoring.job import Job, load_jobs
from tcs.placement.scoring.person import recorded_person
from tcs.placement.store import ARMS, PERSON, ScoreFile, check_scene

_MADE_FROM = ("task", "environment", "robot", "scene_digest")


def made_from(file: ScoreFile) -> dict[str, Any]:
    """Return what identifies the scene of a score file, as plain containers."""
    optional = [key for key in ("only", "constraints", PERSON, ARMS) if key in file.metadata]
    return {
        **{key: file.metadata[key] for key in (*_MADE_FROM, *optional)},
        "observed": file.observed,
    }


def recorded_jobs(record: Mapping[str, Any]) -> tuple[Job, ...]:
    """Return the job of each hand that the metadata of a score file names, before it is built.

    Args:
        record: The metadata, or a record of `made_from`.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
    """
    return load_jobs(
        record["task"],
        record["environment"],
        record["robot"],
        constraints=recorded_constraints(record),
        person=recorded_person(record),
        arms=record.get(ARMS),
    )


def rebuild_scenes(
    file: ScoreFile, *, meshes: bool = False
) -> tuple[tuple[Job, Scene, LoweredScene], ...]:
    """Return job, scene and arrays of each hand of a file.

    Args:
        file: A score file.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreMismatchError: If the models differ from those the file was made from.
    """
    jobs = recorded_jobs(file.metadata)
    hands = [{**job.hand.to_json(), "goals": list(job.goal_numbers)} for job in jobs]
    recorded = [{key: entry[key] for key in hands[0]} for entry in file.hands]
    if recorded != (hands if len(jobs) > 1 else []):
        raise StoreMismatchError(
            f"Scores of '{file.metadata['task']}' are of goals with other hands than those of the "
            "task now. Score it again; choosing from the file still works."
        )
    found = tuple(_built(job, file.observed_axes, meshes) for job in jobs)
    for number, (*_, lowered) in enumerate(found):
        check_scene(file, lowered.digest(), number if file.hands else None)
    return found


def rebuild_made_from(
    record: Mapping[str, Any], *, meshes: bool = False
) -> tuple[tuple[Job, Scene], ...]:
    """Return the job and scene of each hand that a record of `made_from` identifies.

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
    built = [_built(job, axes, meshes) for job in recorded_jobs(record)]
    digest = digest_of_hands([lowered.digest() for *_, lowered in built])
    if digest != record["scene_digest"]:
        raise StoreMismatchError(
            f"The plan for '{record['task']}' was made from other models (scene "
            f"{record['scene_digest'][:12]}) than those installed now (scene {digest[:12]}). Plan "
            "again."
        )
    return tuple((job, scene) for job, scene, _ in built)


def _built(job: Job, observed: tuple[Axis, ...], meshes: bool) -> tuple[Job, Scene, LoweredScene]:
    # A file that was scored live has an observed state of its own.
    job = dataclasses.replace(job, observed=observed)
    scene = job.scene(meshes=meshes)
    return job, scene, job.lowered(scene)
