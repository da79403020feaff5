"""Pictures of a score file: its map, and the robot at the members of a set."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tcs.errors import SelectionError
from tcs.kernel.arrays import BOX
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.robots import links_of_arm
from tcs.model.scene import Scene, alternative_poses, goal_poses
from tcs.model.tasks import Task, partners
from tcs.output.draw import (
    BaseFootprint,
    Category,
    GoalMark,
    PlaceMap,
    ScenePanel,
    draw_map,
    draw_scene,
    primitive_corners,
)
from tcs.output.draw.solids import FloatArray
from tcs.output.report.score.scene_solids import (
    base_outline,
    environment_solids,
    goal_solids,
    robot_solids,
)
from tcs.output.report.score.shown_set import ScoredScene, ShownSet, scored_scenes
from tcs.output.words import (
    assign_goals,
    assigned_goals,
    goal_text,
    goals_text,
    hands_text,
    place_in_line,
)
from tcs.placement.scoring import Job
from tcs.placement.store import ScoreFile

_AROUND_A_GOAL = primitive_corners(BOX, (0.3, 0.3, 0.3))
"""Corners of the region shown around the tool [m]: the gripper and the nearby part of the body."""


def map_figure(
    file: ScoreFile, shown: ShownSet, scored: Sequence[ScoredScene] | None = None
) -> Figure:
    """Return the map of a score file.

    Args:
        file: A score file.
        shown: The set to mark.
        scored: The result of `scored_scenes`, built if None. The function moves the scenes.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    # The base is the same with all hands.
    job, scene = (scored or scored_scenes(file, shown))[0]
    base = base_outline(scene)
    if shown.members:
        _set_environment(scene, shown.members[0])
    return draw_map(
        PlaceMap.of(file.tables[shown.table].scores, Grid.from_dict(file.grid)),
        environment_solids(scene, in_mount=True),
        base_footprints(shown, base),
        goals=goal_marks(scene, job.task, shown),
        here=BaseFootprint(shown.here, base) if shown.here is not None else None,
        title=title_of(job, file),
        subtitle=shown.subtitle,
        measure=file.metadata["measure"],
    )


def base_footprints(shown: ShownSet, base: FloatArray) -> list[BaseFootprint]:
    """Return the members of a set as bases, with their places in words.

    Args:
        shown: The set.
        base: Outline of the base in its own frame [m], shape (n, 2).
    """
    return [
        BaseFootprint(member, base, place_in_line(place))
        for member, place in zip(shown.members, shown.places, strict=True)
    ]


def goal_marks(scene: Scene, task: Task, shown: ShownSet) -> list[GoalMark]:
    """Return the goals in the present state of the scene, in the frame of the base poses."""
    names, assignment = shown.goal_names, assign_goals(shown.scores, shown.rows)
    return [
        GoalMark(goal, names[goal], X.translation(), is_reached=assignment[goal] is not None)
        for goal, poses in enumerate(alternative_poses(scene, task))
        for X in scene.seen_from_mount(poses)
    ]


def scene_figure(file: ScoreFile, shown: ShownSet) -> Figure:
    """Return a picture of the robot at each member, its arm at the goal of greatest dexterity.

    Args:
        file: A score file.
        shown: The set.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
        SelectionError: If the set has no member.
    """
    if not shown.members:
        raise SelectionError(
            "nothing to draw: no initial configuration reaches a goal. `tcs map` shows where the "
            "base can be placed."
        )
    hands = scored_scenes(file, shown)
    panels = [_member_panel(file, hands, shown, i) for i in range(len(shown.members))]
    title = title_of(hands[0].job, file)
    return draw_scene(panels, title=f"{title}\n{shown.subtitle}")


def member_figure(
    file: ScoreFile, shown: ShownSet, number: int, scored: Sequence[ScoredScene] | None = None
) -> Figure:
    """Return two pictures of the robot at one member of the set: the whole robot, and its tool.

    Args:
        file: A score file.
        shown: The set.
        number: Number of the member, from 0.
        scored: The result of `scored_scenes`, built if None. The function moves the scenes.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    scored = scored or scored_scenes(file, shown)
    panels = [_member_panel(file, scored, shown, number, is_close=it) for it in (False, True)]
    return draw_scene(panels, title="")


def title_of(job: Job, file: ScoreFile) -> str:
    """Return the titles of task, environment and robot."""
    return job_title(job, str(file.robot["name"]) if file.hands else None)


def job_title(job: Job, robot: str | None = None) -> str:
    """Return the titles of task, environment and robot; `robot` replaces that of its file."""
    return f"{job.task.title} · {job.spec.environment.title} · {robot or job.spec.robot.title}"


def _set_environment(scene: Scene, member: InitialConfiguration) -> None:
    """Set the joints of the environment to those of a configuration."""
    for name, value in member.environment:
        scene.set_joint(name, value)


def _member_panel(
    file: ScoreFile,
    hands: Sequence[ScoredScene],
    shown: ShownSet,
    number: int,
    *,
    is_close: bool = False,
) -> ScenePanel:
    """Return the panel of one member: robot and person, or a close view of the tool at its goal.

    The robot has the hand that serves the goal.
    """
    member, h = shown.members[number], shown.rows[number]
    scores, names = shown.scores, shown.goal_names
    served = assigned_goals(assign_goals(scores, shown.rows), number)
    current = max(served, key=lambda g: float(scores.dexterity[h, g]), default=None)
    by_hand = np.zeros(scores.goals, np.uint8) if scores.hand is None else scores.hand[h]
    job, scene = hands[0 if current is None else int(by_hand[current])]
    _set_environment(scene, member)
    scene.place_base(member.base_x, member.base_y, member.base_yaw)
    scene.set_torso(member.torso)
    joints = scores.joints_of(h, current) if current is not None else None
    if joints is not None:
        scene.set_arm(joints)
    shown_goals, other_arm = [] if current is None else [current], frozenset[str]()
    if current is not None and job.other_joints:
        # The other arm is at the other goal of the pair.
        partner = partners(job.task.goals)[current]
        assert partner is not None
        of_partner = scores.joints_of(h, partner)
        assert of_partner is not None
        scene.set_robot_joints(job.other_joints, of_partner)
        shown_goals.append(partner)
        other_arm = links_of_arm(job.spec.robot, job.other_joints[0])
    solids = [
        *robot_solids(scene, other_arm),
        *environment_solids(scene),
        *goal_solids(scene, job.task, current),
    ]
    goals = np.array([X_WG.translation() for X_WG in goal_poses(scene, job.task, current)])
    base = scene.base_pose().translation()
    # Views across the line from robot to person, from both sides: neither hides the other.
    along = math.atan2(*(goals.mean(axis=0) - base)[[1, 0]])
    if is_close and current is not None:
        subject, angles_deg = goals[current] + _AROUND_A_GOAL, [60.0, -60.0, 120.0, -120.0]
        caption = f"the tool at goal {goal_text(current, names[current])}"
    else:
        # Furniture may extend beyond the picture; robot, person and goals may not.
        whole = [solid.corners for solid in solids if solid.category is not Category.FURNITURE]
        subject, angles_deg = np.concatenate(whole), [70.0, -70.0]
        used = hands_text([file.hand_names[by_hand[goal]] for goal in served] if file.hands else [])
        where = place_in_line(shown.places[number])
        caption = f"stop {number + 1}{f', {used}' if used else ''}{f': {where}' if where else ''}\n"
        caption += f"serves {goals_text(served, names) if served else 'no goal'}"
        if shown_goals:
            caption += f"; arm{'s' * (len(shown_goals) - 1)} at {goals_text(shown_goals, names)}"
    azimuths = tuple(along + math.radians(angle) for angle in angles_deg)
    marks = [
        GoalMark(goal, names[goal], at, is_reached=bool(scores.reached[h, goal]))
        for goal, at in enumerate(goals)
    ]
    return ScenePanel(solids, subject, azimuths, caption, marks)
