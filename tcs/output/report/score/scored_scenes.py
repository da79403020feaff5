"""The scenes of a score file, in the observed state of a set."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from tcs.model.scene import LoweredScene, Scene
from tcs.output.report.score.shown_set import ShownSet
from tcs.placement.scoring import Job, rebuild_scene, rebuild_scenes, whole_task
from tcs.placement.store import ScoreFile, file_of_arm


class ScoredScene(NamedTuple):
    """The job of a score file, and its scene in the observed state of a set."""

    job: Job
    scene: Scene


def scored_scene(
    file: ScoreFile, shown: ShownSet, *, arm: str | None = None, meshes: bool = False
) -> ScoredScene:
    """Return the job and the scene of a score file.

    Args:
        file: A score file.
        shown: The set whose observed state the scene is in.
        arm: The arm of the robot, in a file of several.
        meshes: Whether the robot's meshes are loaded, for the viewer.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
        SelectionError: If the file is of several arms, and none is given, or of several hands.
    """
    of_arm = file if arm is None else file_of_arm(file, arm)
    return _observed(file, shown, rebuild_scene(of_arm, meshes=meshes))


def scored_hands(file: ScoreFile, shown: ShownSet) -> tuple[ScoredScene, ...]:
    """Return the scene of each hand of a file of several; the job of each has all goals.

    Args:
        file: A score file of several hands.
        shown: The set whose observed state the scenes are in.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    built = rebuild_scenes(file)
    task = whole_task([job for job, *_ in built])
    return tuple(
        _observed(file, shown, (dataclasses.replace(job, task=task), scene, lowered))
        for job, scene, lowered in built
    )


def scene_of_base(file: ScoreFile, shown: ShownSet) -> ScoredScene:
    """Return a scene with the base and the goals of a file: that of its first arm or hand.

    Args:
        file: A score file.
        shown: The set whose observed state the scene is in.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    if file.hands:
        return scored_hands(file, shown)[0]
    # The base is the same with either arm.
    return scored_scene(file, shown, arm=next(iter(file.arms), None))


def _observed(
    file: ScoreFile, shown: ShownSet, built: tuple[Job, Scene, LoweredScene]
) -> ScoredScene:
    """Return a scene in the observed state of a set."""
    job, scene, _ = built
    for name, value in file.observed_states[shown.table].items():
        scene.set_joint(name, value)
    return ScoredScene(job, scene)
