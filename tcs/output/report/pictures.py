"""Pictures of a score file: what to draw is read off its scene, and handed to `tcs.output.draw`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from tcs.errors import SelectionError
from tcs.kernel.arrays import BOX
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.scene import Scene, goal_poses
from tcs.model.scene.contacts import Group, Part, shape_of
from tcs.model.scene.environment import FLOOR
from tcs.output.draw import (
    Kind,
    PlaceMap,
    Solid,
    Stand,
    View,
    draw_map,
    draw_scene,
    primitive_corners,
)
from tcs.output.draw.solids import FloatArray, outline
from tcs.output.words import assign_goals, assigned_goals, base_pose_text, goals_text, scores_text
from tcs.placement.scoring import Job, rebuild_scene
from tcs.placement.selection import SelectionTables, UtilityWeights, nearest_table, select
from tcs.placement.store import ScoreFile

_ARROW = (0.15, 0.06, 0.010, 0.026)
"""Of a goal's arrow: length, length of its head, half width of shaft and head [m]."""
_AROUND_A_GOAL = primitive_corners(BOX, (0.3, 0.3, 0.3))
"""Corners of what is shown around the tool [m]: a hand, and the part of the body it is at."""


@dataclass(frozen=True)
class Shown:
    """The set that is drawn."""

    here: InitialConfiguration | None
    """Where the robot is now, if that matters."""
    members: tuple[InitialConfiguration, ...]
    """Its members in the order of the tour; none when no goal is reached from anywhere."""
    indices: tuple[int, ...]
    """Their flat configuration indices."""
    table: int
    """Number of the file's table it is a set of."""
    subtitle: str
    """Its scores, for a person."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        here: InitialConfiguration | None,
        max_members: int | None = None,
        observed: Mapping[str, float] | None = None,
    ) -> Shown:
        """Return the set to choose from here, or the best one when `here` is None.

        Args:
            file: A score file.
            here: The current state.
            max_members: Most members of the set; by default as many as the file holds.
            observed: How the person is found: values of the observed axes [m or rad].
        """
        table = nearest_table(file, here, observed).index
        sets = file.tables[table].sets
        if here is not None:
            choice = select(file, here, max_members=max_members, observed=observed)
            members = tuple(choice.members[i] for i in choice.order)
            indices = tuple(choice.indices[i] for i in choice.order)
            what = (
                f"chosen for a robot at {base_pose_text(here.to_json())}, "
                f"travel cost {choice.cost:.2f}"
            )
        else:
            indices = _best_of(file, table, max_members)
            grid = Grid.from_dict(file.grid)
            members = tuple(grid.configuration(h) for h in indices)
            what = "best set"
        if not members:
            return cls(None, (), (), table, "no goal is reached from anywhere")
        scores = scores_text(*sets.scores_of(tuple(sorted(indices))), file.metadata["measure"])
        return cls(here, members, indices, table, f"{what}: {scores}")


def _best_of(file: ScoreFile, table: int, max_members: int | None) -> tuple[int, ...]:
    """Return the best set of a table with at most so many members, wherever the robot is.

    Raises:
        SelectionError: If the file holds no sets of so many.
    """
    sets = file.tables[table].sets
    if max_members is None or len(sets.best) <= max_members <= sets.max_members:
        return sets.best
    if max_members == 1:
        return sets.best_single
    anywhere = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    free = UtilityWeights(travel=0.0)
    tables = SelectionTables.of(file, table)
    return select(tables, anywhere, weights=free, max_members=max_members).indices


Stage = tuple[Job, Scene]
"""What a file was scored from, and its scene as the set is to be found."""


def map_figure(file: ScoreFile, shown: Shown, staged: Stage | None = None) -> Figure:
    """Return the map of a score file.

    Args:
        file: A score file.
        shown: The set to mark.
        staged: `stage` of both, where there is one already; its scene is moved about.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    job, scene = staged or stage(file, shown)
    base = base_outline(scene)
    _set_room(scene, shown.members)
    return draw_map(
        PlaceMap.of(file.tables[shown.table].scores, job.grid),
        room_solids(scene),
        [Stand(member, base) for member in shown.members],
        here=Stand(shown.here, base) if shown.here is not None else None,
        title=title_of(job),
        subtitle=shown.subtitle,
        measure=file.metadata["measure"],
    )


def scene_figure(file: ScoreFile, shown: Shown) -> Figure:
    """Return a picture of the robot at each member, its arm at the goal it serves best there.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
        SelectionError: If there is no member to stand the robot at.
    """
    if not shown.members:
        raise SelectionError(
            "Nothing to draw: no goal is reached from any initial configuration. `tcs map` shows "
            "where the robot can stand at all."
        )
    job, scene = stage(file, shown)
    views = [_view(file, job, scene, shown, i) for i in range(len(shown.members))]
    return draw_scene(views, title=f"{title_of(job)}\n{shown.subtitle}")


def member_figure(
    file: ScoreFile, shown: Shown, number: int, staged: Stage | None = None
) -> Figure:
    """Return two pictures of the robot at one member of the set: all of it, and the tool nearby.

    Args:
        file: A score file.
        shown: The set.
        number: Number of the member, from 0.
        staged: `stage` of both, where there is one already; its scene is moved about.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    job, scene = staged or stage(file, shown)
    views = [_view(file, job, scene, shown, number, is_close=close) for close in (False, True)]
    return draw_scene(views, title="")


def stage(file: ScoreFile, shown: Shown) -> Stage:
    """Return what a file was scored from, and its scene; refuse other models than those."""
    job, scene, _ = rebuild_scene(file)
    for name, value in file.observed_states[shown.table].items():
        scene.set_joint(name, value)
    return job, scene


def title_of(job: Job) -> str:
    """Return task, environment and robot, for a person."""
    return f"{job.task.title} · {job.spec.environment.title} · {job.spec.robot.title}"


def _set_room(scene: Scene, members: tuple[InitialConfiguration, ...]) -> None:
    """Set the room as the first member wants it."""
    for name, value in members[0].environment if members else ():
        scene.set_joint(name, value)


def _view(
    file: ScoreFile, job: Job, scene: Scene, shown: Shown, number: int, *, is_close: bool = False
) -> View:
    """Return the view of one member: of robot and person, or of the tool at its goal alone."""
    member, h = shown.members[number], shown.indices[number]
    scores = file.tables[shown.table].scores
    served = assigned_goals(assign_goals(scores, shown.indices), number)
    _set_room(scene, (member,))
    scene.place_base(member.base_x, member.base_y, member.base_yaw)
    scene.set_torso(member.torso)
    current = max(served, key=lambda g: float(scores.dexterity[h, g]), default=None)
    joints = scores.joints_of(h, current) if current is not None else None
    if joints is not None:
        scene.set_arm(joints)
    solids = [*_robot(scene), *room_solids(scene), *_goals(scene, job, current)]
    goals = np.array([X_WG.translation() for X_WG in goal_poses(scene, job.task)])
    # The bed may go on beyond the picture; whoever is helped may not.
    shown_whole = [solid.corners for solid in solids if solid.kind is not Kind.FURNITURE]
    subject, turns = np.concatenate(shown_whole), [70.0, -70.0]
    base = np.array([member.base_x, member.base_y, 0.0])
    # Across the line from robot to person, from both sides: neither stands before the other.
    along = math.atan2(*(goals.mean(axis=0) - base)[[1, 0]])
    caption = f"stop {number + 1}, serves {goals_text(served) if served else 'no goal'}"
    if current is not None:
        caption += f"; arm at goal {current}"
    if is_close and current is not None:
        subject, turns = goals[current] + _AROUND_A_GOAL, [60.0, -60.0, 120.0, -120.0]
        caption = f"the tool at goal {current}"
    return View(
        solids,
        subject,
        tuple(along + math.radians(turn) for turn in turns),
        caption,
    )


def _robot(scene: Scene) -> list[Solid]:
    kinds = {Group.ARM: Kind.ARM, Group.BODY: Kind.ROBOT}
    return [
        _solid(scene, part, kinds[part.group]) for part in scene.built.parts if part.group in kinds
    ]


def room_solids(scene: Scene) -> list[Solid]:
    """Return furniture, person and obstacles."""
    return [_solid(scene, part, kind) for part, kind in room_parts(scene)]


def room_parts(scene: Scene) -> list[tuple[Part, Kind]]:
    """Return every shape of the environment but the floor, as furniture or person."""
    plant, environment = scene.built.plant, scene.spec.environment
    found = []
    for part in scene.built.parts:
        if part.group is Group.ENVIRONMENT and part.name != FLOOR:
            instance = plant.get_body(part.body).model_instance()
            is_person = environment.is_person(plant.GetModelInstanceName(instance))
            found.append((part, Kind.PERSON if is_person else Kind.FURNITURE))
    return found


def _goals(scene: Scene, job: Job, current: int | None) -> list[Solid]:
    """Return an arrow for each goal: it ends where the tool has to be, and points where it does."""
    length, head, thin, wide = _ARROW
    half = 0.5 * (length - head)
    shaft = primitive_corners(BOX, (half, thin, thin)) - [head + half, 0.0, 0.0]
    square = np.array([[wide, wide], [-wide, wide], [-wide, -wide], [wide, -wide]])
    tip = np.vstack([np.column_stack([np.full(4, -head), square]), np.zeros((1, 3))])
    solids = []
    for g, X_WG in enumerate(goal_poses(scene, job.task)):
        kind = Kind.CURRENT_GOAL if g == current else Kind.GOAL
        R, p = X_WG.rotation().matrix(), X_WG.translation()
        solids += [Solid.placed(kind, corners, R, p) for corners in (shaft, tip)]
    return solids


def _solid(scene: Scene, part: Part, kind: Kind) -> Solid:
    corners = primitive_corners(*shape_of(scene.built.scene_graph.model_inspector(), part))
    X_WP = scene.query_object().GetPoseInWorld(part.geometry)
    return Solid.placed(kind, corners, X_WP.rotation().matrix(), X_WP.translation())


def base_outline(scene: Scene) -> FloatArray:
    """Return the outline of what stands on the floor, in the base's frame [m], shape (n, 2).

    The base of the scene is left at the origin.
    """
    scene.place_base(0.0, 0.0, 0.0)
    plant, standing = scene.built.plant, scene.spec.robot.standing_bodies
    body = [part for part in scene.built.parts if part.group is Group.BODY]
    base = [part for part in body if plant.get_body(part.body).name() in standing] or body
    corners = [_solid(scene, part, Kind.ROBOT).corners[:, :2] for part in base]
    return outline(np.concatenate(corners))
