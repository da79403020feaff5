"""The job and scene of a score file, or of what was made from one, built from installed models."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from tcs.errors import StoreError, StoreMismatchError
from tcs.model.grid import Axis
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.constraints import recorded_constraints
from tcs.placement.scoring.hands import digest_of_hands
from tcs.placement.scoring.job import Job, load_jobs
from tcs.placement.scoring.person import recorded_person
from tcs.placement.store import ARMS, PAPER, PERSON, ScoreFile

_MADE_FROM = ("task", "environment", "robot", "scene_digest")


def made_from(file: ScoreFile) -> dict[str, Any]:
    """Return what identifies the scene of a score file, as plain containers."""
    optional = [key for key in ("only", "constraints", PERSON, ARMS, PAPER) if key in file.metadata]
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
        paper=bool(record.get(PAPER)),
    )


def rebuild_scenes(
    made: ScoreFile | Mapping[str, Any], *, meshes: bool = False
) -> tuple[tuple[Job, Scene, LoweredScene], ...]:
    """Return job, scene and arrays of each hand of a file.

    Args:
        made: A score file; or, of what was made from one, the record of `made_from`.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        UnknownNameError: If its task, environment or robot does not exist.
        DataFileError: If a file that it names cannot be used.
        StoreError: If the record is incomplete.
        StoreMismatchError: If the models differ from those the file was made from.
    """
    record = made_from(made) if isinstance(made, ScoreFile) else made
    if not all(isinstance(record.get(key), str) for key in _MADE_FROM):
        raise StoreError(f"'made_from' must hold {', '.join(_MADE_FROM)}.")
    observed = record.get("observed", [])
    if not isinstance(observed, list) or not all(isinstance(axis, dict) for axis in observed):
        raise StoreError("'made_from' must hold 'observed' as a list of axes.")
    jobs = recorded_jobs(record)
    what, again = f"The plan for '{record['task']}' was made", "Plan again."
    digests = [record["scene_digest"]]
    if isinstance(made, ScoreFile):
        _check_hands(made, jobs)
        what = f"Scores of '{record['task']}' were made by tcs {made.metadata['program_version']}"
        again = "Score the task again; choosing from the file still works."
        digests = [entry["scene_digest"] for entry in made.hands] or digests
    # A file that was scored live has an observed state of its own.
    axes = tuple(Axis.from_dict(axis, where="observed") for axis in observed)
    jobs = tuple(dataclasses.replace(job, observed=axes) for job in jobs)
    scenes = [job.scene(meshes=meshes) for job in jobs]
    built = tuple((job, at, job.lowered(at)) for job, at in zip(jobs, scenes, strict=True))
    stored, digest = (
        digest_of_hands(of_hands)
        for of_hands in (digests, [lowered.digest() for *_, lowered in built])
    )
    if stored != digest:
        raise StoreMismatchError(
            f"{what} from other models (scene {stored[:12]}) than those installed now (scene "
            f"{digest[:12]}). {again}"
        )
    return built


def _check_hands(file: ScoreFile, jobs: Sequence[Job]) -> None:
    """Refuse a file whose goals are of other hands than those of its task now."""
    hands = [{**job.hand.to_json(), "goals": list(job.goal_numbers)} for job in jobs]
    recorded = [{key: entry[key] for key in hands[0]} for entry in file.hands]
    if recorded != (hands if len(jobs) > 1 else []):
        raise StoreMismatchError(
            f"Scores of '{file.metadata['task']}' are of goals with other hands than those of the "
            "task now. Score it again; choosing from the file still works."
        )
