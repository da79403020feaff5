"""The scenes of a score file, in the observed state of a set."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from tcs.model.scene import Scene
from tcs.output.report.score.shown_set import ShownSet
from tcs.placement.scoring import Job, rebuild_scenes, whole_task
from tcs.placement.store import ScoreFile


class ScoredScene(NamedTuple):
    """The job of a score file with all its goals, and its scene in the observed state of a set."""

    job: Job
    scene: Scene


def scored_scenes(
    file: ScoreFile, shown: ShownSet, *, meshes: bool = False
) -> tuple[ScoredScene, ...]:
    """Return the job and the scene of each hand of a score file.

    Args:
        file: A score file.
        shown: The set whose observed state the scenes are in.
        meshes: Whether the robot's meshes are loaded, for the viewer.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    built = rebuild_scenes(file, meshes=meshes)
    task = whole_task([job for job, *_ in built])
    found = []
    for job, scene, _ in built:
        for name, value in file.observed_states[shown.table].items():
            scene.set_joint(name, value)
        found.append(ScoredScene(dataclasses.replace(job, task=task), scene))
    return tuple(found)
