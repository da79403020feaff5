"""Robot, person and furniture in space at a base pose: shapes, and where each body is."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.reasons import nearest_configuration
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Reason

if TYPE_CHECKING:
    from pydrake.multibody.tree import BodyIndex

    from tcs.model.scene import Scene
    from tcs.model.tasks import Task

_KEPT = 3
"""Most scenes that are kept."""
_DECIMALS = 4
"""Decimals of positions [m] and of quaternions."""
_SHAPES = ("sphere", "capsule", "box")
"""Names of the kernel's shapes, by their numbers."""


@dataclass(frozen=True, eq=False)
class _ShownScene:
    """The scene of a score file, and what is the same in each of its states."""

    task: Task
    scene: Scene
    shapes: list[dict[str, Any]]
    bodies: list[BodyIndex]
    """The bodies that the shapes are fixed to."""


class ScenePostures:
    """Scenes of score files, kept while they are looked at."""

    def __init__(self) -> None:
        """Keep no scene yet."""
        self._lock = threading.Lock()
        self._scenes: OrderedDict[str, tuple[_ShownScene, ...]] = OrderedDict()
        """Of each file the scene of each hand."""

    def at(
        self,
        digest: str,
        file: ScoreFile,
        stated: InitialConfiguration,
        *,
        goal: int | None = None,
        arm: Sequence[Sequence[float]] = (),
    ) -> dict[str, Any]:
        """Return the scene at a base pose.

        Args:
            digest: Digest of the score file, under which its scene is kept.
            file: The score file; of one with several hands, the one that serves the goal is shown.
            stated: The configuration; the nearest one of the grid is shown.
            goal: The goal that the arm is at; by default the one of greatest dexterity. The arm is
                at rest where it does not reach it.
            arm: ScenePostures of the arm [rad or m], instead of that at the goal: a frame for each.

        Returns:
            `shapes`: each with its body, category, contact name, type, size [m] and pose in the
            body, the same objects at each call; `frames`: for each frame the pose of every body in
            W, as x, y, z [m] and the quaternion w, x, y, z; `goals`: positions and the direction
            from which the tool comes; `goal`: the goal that the arm is at, or None.

        Raises:
            SelectionError: If there is no such goal, a posture has another number of joints, or
                `stated` is beyond the grid.
            StoreMismatchError: If the models are not those the file was made from.
        """
        grid, scores = file.configurations, file.nominal.scores
        index, _ = nearest_configuration(grid, stated)
        if goal is not None and not 0 <= goal < scores.goals:
            raise SelectionError(f"there is no goal {goal}; there are {scores.goals}, from 0.")
        if goal is None and scores.reached[index].any():
            goal = int(np.argmax(scores.dexterity[index]))
        is_reached = goal is not None and scores.reason[index, goal] == Reason.REACHED
        with self._lock:
            return self._posed(digest, file, index, goal if is_reached else None, arm)

    def _posed(
        self,
        digest: str,
        file: ScoreFile,
        index: int,
        goal: int | None,
        arm: Sequence[Sequence[float]],
    ) -> dict[str, Any]:
        from tcs.model.scene import goal_poses

        scores = file.nominal.scores
        hand = 0 if goal is None or scores.hand is None else int(scores.hand[index, goal])
        shown = self._scene(digest, file)[hand]
        scene = shown.scene
        member = file.configurations.configuration(index)
        for name, value in member.environment:
            scene.set_joint(name, value)
        scene.place_base(member.base_x, member.base_y, member.base_yaw)
        scene.set_torso(member.torso)
        joints = None if goal is None else file.nominal.scores.joints_of(index, goal)
        postures = [scene.resting_arm() if joints is None else joints]
        if len(arm):
            count = len(postures[0])
            if any(len(one) != count for one in arm):
                raise SelectionError(f"'arm' must hold {count} values for each posture.")
            postures = [np.array(one) for one in arm]
        frames = []
        for posture in postures:
            scene.set_arm(posture)
            plant, context = scene.built.plant, scene.plant_context
            poses = [
                plant.EvalBodyPoseInWorld(context, plant.get_body(body)) for body in shown.bodies
            ]
            frames.append([_plain(X) for X in poses])
        goals = [
            [*X.translation(), *X.rotation().matrix()[:, 0]]
            for X in goal_poses(scene, shown.task, goal)
        ]
        return {
            "configuration": index,
            "shapes": shown.shapes,
            "frames": frames,
            "goals": np.round(goals, _DECIMALS).tolist(),
            "goal": goal,
        }

    def _scene(self, digest: str, file: ScoreFile) -> tuple[_ShownScene, ...]:
        """Return the scene of each hand of a file, built when it is first looked at."""
        from tcs.output.report.score.shown_set import ShownSet, scored_scenes

        if digest not in self._scenes:
            shown = ShownSet(None, (), (), file.nominal_index, "", file)
            self._scenes[digest] = tuple(
                _ShownScene(job.task, scene, *_shapes_of(scene))
                for job, scene in scored_scenes(file, shown)
            )
        self._scenes.move_to_end(digest)
        while len(self._scenes) > _KEPT:
            self._scenes.popitem(last=False)
        return self._scenes[digest]


def _shapes_of(scene: Scene) -> tuple[list[dict[str, Any]], list[BodyIndex]]:
    """Return the shapes of a scene but its floor, and the bodies that they are fixed to."""
    from tcs.model.scene.contacts import Group, shape_of
    from tcs.output.report.score.scene_solids import environment_parts

    inspector = scene.built.scene_graph.model_inspector()
    parts = [(part, category.name.lower()) for part, category in environment_parts(scene)]
    for part in scene.built.parts:
        if part.group is not Group.ENVIRONMENT:
            parts.append((part, "arm" if part.group is Group.ARM else "robot"))
    bodies = list(dict.fromkeys(part.body for part, _ in parts))
    number = {body: i for i, body in enumerate(bodies)}
    shapes = []
    for part, category in parts:
        kind, size = shape_of(inspector, part)
        shapes.append(
            {
                "body": number[part.body],
                "category": category,
                "name": part.name,
                "type": _SHAPES[kind],
                "size": np.round(size, _DECIMALS).tolist(),
                "at": _plain(inspector.GetPoseInFrame(part.geometry)),
            }
        )
    return shapes, bodies


def _plain(X: Any) -> list[float]:
    """Return a pose as x, y, z and the quaternion w, x, y, z."""
    pose = [*X.translation(), *X.rotation().ToQuaternion().wxyz()]
    return [round(float(value), _DECIMALS) for value in pose]
