"""Lowering: from a Drake plant to the arrays of the kernel, every number read from the plant."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Frame, PrismaticJoint

from tcs.errors import UnknownNameError
from tcs.kernel.arrays import (
    NO_DISTANCES,
    BodyDistances,
    Chain,
    FloatArray,
    GridArrays,
    IntArray,
    SceneArrays,
    Shapes,
)
from tcs.model.grid import Grid
from tcs.model.robots.distances import tables_in_force
from tcs.model.scene.attached import AttachedPoses
from tcs.model.scene.chain import JointAxis, link_frames
from tcs.model.scene.contacts import ContactRule, Group, Part, shape_of
from tcs.model.scene.lowered_scene import LoweredScene, read_only
from tcs.model.scene.plant import coupled_frames, standing_contacts
from tcs.model.scene.scene import Scene
from tcs.model.scene.turning import freedom_rows
from tcs.model.tasks import Task

JOINTS = 7
"""Joints of the kernel's chain."""
NEAR_BY_ANGLE = 0.1
"""Distance that counts as much as an angle, between poses of a goal [m/rad]: a hand's length."""


def lower(scene: Scene, task: Task | None, grid: Grid) -> LoweredScene:
    """Return the arrays of a scene for a task, read from its Drake plant and scene graph.

    Args:
        scene: The scene; its state is restored.
        task: The task, whose goals and allowed contacts apply; None for arrays without goals.
        grid: The configurations; its environment axes move the joints of the same name.

    Raises:
        UnknownNameError: If the environment lacks the body frame of a goal or the joint of a grid
            axis, or the task allows contact between bodies that do not exist.
        GridError: If a grid axis exceeds its joint's limits, or has another unit.
        EnvironmentFileError: If the kernel does not support a shape.
        TaskError: If an arm of five joints lacks the freedom of a goal that it needs.
    """
    before = scene.positions()
    try:
        return _lowered(scene, task, grid)
    finally:
        scene.restore(before)


def _lowered(scene: Scene, task: Task | None, grid: Grid) -> LoweredScene:
    built = scene.built
    environment = scene.spec.environment.name
    where = f"environment '{environment}'"
    if task is not None:
        where = f"task '{task.name}', {where}"
    rule = ContactRule.of(
        built.parts,
        scene.spec.robot.disabled_pairs,
        (
            *(() if task is None else task.allowed_contacts),
            *standing_contacts(scene.spec, built.parts),
        ),
        where=f"{where}, allowed contacts",
        on_floor=scene.spec.environment.mount is None,
    )
    arm = [part for part in built.parts if part.group is Group.ARM]
    body = [part for part in built.parts if part.group is Group.BODY]
    environment_parts = [part for part in built.parts if part.group is Group.ENVIRONMENT]
    robot_bodies = _names([*arm, *body])
    environment_bodies = _names(environment_parts)

    scene.place_base(0.0, 0.0, 0.0)
    scene.set_arm(np.zeros(len(built.arm_joints)))
    torso_levels = grid.axis("torso").values
    chain, X_AL = arm_chain(scene)
    arm_base, body_poses = _torso_states(scene, torso_levels)
    for axis in grid.environment_axes:
        built.environment_joints.check_axis(axis, where=where)
    environment_poses, goal_matrices = _environment_states(scene, task, grid.environment_states())

    arrays = SceneArrays(
        chain=chain,
        arm_base_R=_rotations(_matrices([arm_base]))[0],
        arm_base_p=_origins(_matrices([arm_base]))[0],
        arm=_shapes(scene, arm, robot_bodies, _matrices([_arm_poses(scene, arm, X_AL)])),
        body=_shapes(scene, body, robot_bodies, body_poses),
        environment=_shapes(scene, environment_parts, environment_bodies, environment_poses),
        arm_vs_arm=rule.checked(arm, arm),
        arm_vs_body=rule.checked(arm, body),
        arm_vs_environment=rule.checked(arm, environment_parts),
        body_vs_environment=rule.checked(body, environment_parts),
        margin=scene.spec.environment.contact_margin,
        self_margin=scene.spec.robot.self_margin,
        goal_R=_rotations(goal_matrices),
        goal_p=_origins(goal_matrices),
        freedom=freedom_rows(task, chain, scene.spec.robot.name),
        first_pose=_first_poses(task),
        distances=_distances(scene, robot_bodies),
        rest=_rest(scene),
    )
    return LoweredScene(
        arrays=read_only(arrays),
        grid=read_only(
            GridArrays(
                environment_states=len(goal_matrices),
                base_x=grid.axis("base_x").values,
                base_y=grid.axis("base_y").values,
                base_yaw=grid.axis("base_yaw").values,
                torso_levels=len(torso_levels),
            )
        ),
        robot_bodies=robot_bodies,
        environment_bodies=environment_bodies,
        goals=() if task is None else tuple(f"{task.name} {i}" for i in range(len(task.goals))),
    )


def _first_poses(task: Task | None) -> IntArray:
    """Return the first pose of each goal, then their number; empty if each goal is one pose."""
    counts = [] if task is None else [len(goal.poses) for goal in task.goals]
    several = any(count > 1 for count in counts)
    return np.cumsum([0, *counts], dtype=np.int64) if several else np.empty(0, np.int64)


def _rest(scene: Scene) -> FloatArray:
    """Return the rest postures of the arm as the kernel takes them [rad], shape (n, 7)."""
    postures = np.array(list(scene.spec.robot.rest_postures().values()))
    return np.column_stack([np.zeros((len(postures), JOINTS - postures.shape[1])), postures])


def _distances(scene: Scene, bodies: tuple[str, ...]) -> BodyDistances:
    """Return the tables of distances of the robot's bodies that have shapes.

    Raises:
        RobotError: If the file of the tables cannot be read.
    """
    robot = scene.spec.robot
    tables = [t for t in tables_in_force(robot) if set(t.pair) <= set(bodies)]
    if not tables:
        return NO_DISTANCES
    number = {name: i for i, name in enumerate(bodies)}
    joint = {name: JOINTS - len(robot.arm_joints) + i for i, name in enumerate(robot.arm_joints)}
    return BodyDistances(
        body=np.array([[number[name] for name in t.pair] for t in tables], np.int64),
        joint=np.array([[joint[name] for name in t.joints] for t in tables], np.int64),
        size=np.array([t.corners.shape for t in tables], np.int64),
        reach=np.array([t.reach for t in tables], np.float64),
        corners=np.concatenate([t.corners.ravel() for t in tables]),
    )


def arm_chain(scene: Scene) -> tuple[Chain, list[RigidTransform]]:
    """Return the arm's chain, and the poses of its link frames in A with all joints at zero.

    Args:
        scene: The scene, its arm at zero.
    """
    built, state = scene.built, scene.plant_context
    axes, slides = [], []
    for joint, followers in zip(built.arm_joints, built.coupled_joints, strict=True):
        X_AJ = joint.frame_on_child().CalcPose(state, built.arm_base_frame)
        is_prismatic = isinstance(joint, PrismaticJoint)
        direction = joint.translation_axis() if is_prismatic else joint.revolute_axis()
        axes.append(JointAxis(X_AJ.rotation().matrix(), X_AJ.translation(), direction))
        slides.append((1.0 + len(followers)) if is_prismatic else 0.0)
    # An arm of six joints has one more before its first, about the same axis, which remains at 0;
    # one of five has two.
    fixed = JOINTS - len(axes)
    R_AL, p_AL = link_frames((*axes[:1] * fixed, *axes))
    X_AL = [_transform(R, p) for R, p in zip(R_AL, p_AL, strict=True)]
    X_AT = built.tool_frame.CalcPose(state, built.arm_base_frame)
    # At zero every Rz is the identity, so F[i] is the transform between consecutive frames.
    frames = [RigidTransform(), *X_AL, X_AT]
    steps = [before.inverse() @ after for before, after in itertools.pairwise(frames)]
    chain = Chain(
        R=_rotations(_matrices([steps]))[0],
        p=_origins(_matrices([steps]))[0],
        lower=np.concatenate([np.full(fixed, -np.inf), built.arm_lower]),
        upper=np.concatenate([np.full(fixed, np.inf), built.arm_upper]),
        joints=len(axes),
        slides=np.array([0.0] * fixed + slides),
        coupled=coupled_frames(built.coupled_joints, fixed),
    )
    return chain, X_AL


def _arm_poses(scene: Scene, parts: list[Part], X_AL: list[RigidTransform]) -> list[RigidTransform]:
    """Return the poses of the arm's shapes in the link frames that carry them."""
    X_WA = scene.built.arm_base_frame.CalcPoseInWorld(scene.plant_context)
    joints = scene.built.coupled_joints
    # With all joints at zero, links between coupled joints have the frame of their joint's link.
    between = coupled_frames(joints, JOINTS - len(joints))[:, 0].astype(int)
    frames = [*X_AL, *(X_AL[i] for i in between)]
    poses = []
    for part in parts:
        X_WL = X_WA @ frames[part.carrier - 1]
        poses.append(X_WL.inverse() @ scene.shape_pose(part))
    return poses


def _torso_states(scene: Scene, levels: Iterable[float]) -> tuple[list[RigidTransform], FloatArray]:
    """Return X_BA, and the poses of the rest of the robot in B, for each torso level.

    Returns:
        The latter of shape (levels, parts, 3, 4).
    """
    attached = scene.attached(Group.BODY)
    arm_base, frames, X_BW = [], [], RigidTransform()
    for level in levels:
        scene.set_torso(float(level))
        X_BW = scene.base_pose().inverse()
        X_WA = scene.built.arm_base_frame.CalcPoseInWorld(scene.plant_context)
        arm_base.append(X_BW @ X_WA)
        frames.append(attached.frames_in_world(scene.plant_context))
    # The torso does not move the base.
    X_WG = attached.at(_stacked(frames, len(attached.frames)))
    R_BW, p_BW = X_BW.rotation().matrix(), X_BW.translation()[:, None]
    return arm_base, np.concatenate([R_BW @ X_WG[..., :3], R_BW @ X_WG[..., 3:] + p_BW], axis=-1)


def environment_at(
    lowered: LoweredScene, scene: Scene, task: Task, states: Iterable[Mapping[str, float]]
) -> SceneArrays:
    """Return the arrays of a lowered scene with its environment in other states than the grid's.

    Args:
        lowered: The scene as arrays.
        scene: The scene itself; its state is restored.
        task: The goals.
        states: Positions of the environment's joints by name [m or rad]; joints that a state does
            not name keep their positions of the previous state.

    Returns:
        Arrays of these environment states; for a state of the grid, the same numbers as lowering
        the grid gives.

    Raises:
        UnknownNameError: If there is no such joint.
        TcsError: If a joint follows another one, or a position exceeds its limits.
    """
    before = scene.positions()
    try:
        environment_poses, goal_matrices = _environment_states(scene, task, states)
    finally:
        scene.restore(before)
    moved = lowered.arrays.environment._replace(
        R=_rotations(environment_poses), p=_origins(environment_poses)
    )
    return lowered.arrays._replace(
        environment=moved, goal_R=_rotations(goal_matrices), goal_p=_origins(goal_matrices)
    )


def torso_at(lowered: LoweredScene, scene: Scene, levels: Iterable[float]) -> SceneArrays:
    """Return the arrays of a lowered scene with the torso at other heights than the grid's.

    Args:
        lowered: The scene as arrays.
        scene: The scene itself; its state is restored.
        levels: Torso heights [m].

    Returns:
        Arrays of these torso levels; for a level of the grid, the same numbers as lowering the
        grid gives.
    """
    before = scene.positions()
    try:
        scene.place_base(0.0, 0.0, 0.0)
        scene.set_arm(np.zeros(len(scene.built.arm_joints)))
        arm_base, poses = _torso_states(scene, levels)
    finally:
        scene.restore(before)
    arm_bases = _matrices([arm_base])
    kept = slice(None) if lowered.body_shapes is None else lowered.body_shapes
    return lowered.arrays._replace(
        arm_base_R=_rotations(arm_bases)[0],
        arm_base_p=_origins(arm_bases)[0],
        body=lowered.arrays.body._replace(
            R=np.ascontiguousarray(_rotations(poses)[:, kept]),
            p=np.ascontiguousarray(_origins(poses)[:, kept]),
        ),
    )


def _environment_states(
    scene: Scene, task: Task | None, states: Iterable[Mapping[str, float]]
) -> tuple[FloatArray, FloatArray]:
    """Return the poses in M of the environment's shapes and of the goals, for each state.

    M is W, or the frame of the robot's mount: in either the base moves in the x-y plane.

    Returns:
        Shapes (states, parts, 3, 4) and (states, poses, 3, 4).
    """
    of_parts = scene.attached(Group.ENVIRONMENT)
    of_goals = AttachedPoses.of([] if task is None else _goals_in_frames(scene, task))
    shapes, goals = [], []
    present: dict[str, float] = {}
    for state in states:
        for name, value in state.items():
            if present.get(name) != value:
                scene.set_joint(name, value)
                present[name] = value
        shapes.append(_seen_from_mount(scene, of_parts.frames_in_world(scene.plant_context)))
        goals.append(_seen_from_mount(scene, of_goals.frames_in_world(scene.plant_context)))
    return (
        of_parts.at(_stacked(shapes, len(of_parts.frames))),
        of_goals.at(_stacked(goals, len(of_goals.frames))),
    )


def _seen_from_mount(scene: Scene, X_WF: FloatArray) -> FloatArray:
    """Return X_MF of frames at the present state, shape (n, 3, 4)."""
    if scene.spec.environment.mount is None:
        return X_WF
    X_MW = scene.mount_pose().inverse().GetAsMatrix34()
    X_MF = X_MW[:, :3] @ X_WF
    X_MF[:, :, 3] += X_MW[:, 3]
    return np.asarray(X_MF)


def goal_poses(scene: Scene, task: Task, served: int | None = None) -> list[RigidTransform]:
    """Return X_WG of every goal of a task, of its first pose, at the scene's current state.

    Args:
        scene: The scene.
        task: The task.
        served: Number of a goal that the arm is at: of its poses, the nearest to the tool is taken.

    Raises:
        UnknownNameError: If the environment lacks the body frame of a goal.
    """
    poses = alternative_poses(scene, task)
    found = [of_goal[0] for of_goal in poses]
    if served is not None and len(poses[served]) > 1:
        X_WT = scene.tool_pose()

        def apart(X_WG: RigidTransform) -> float:
            X_TG = X_WT.inverse() @ X_WG
            angle = float(X_TG.rotation().ToAngleAxis().angle())
            return float(np.linalg.norm(X_TG.translation())) + NEAR_BY_ANGLE * angle

        found[served] = min(poses[served], key=apart)
    return found


def alternative_poses(scene: Scene, task: Task) -> list[list[RigidTransform]]:
    """Return X_WG of all poses of every goal of a task, at the scene's current state.

    Raises:
        UnknownNameError: If the environment lacks the body frame of a goal.
    """
    found = iter(
        frame.CalcPoseInWorld(scene.plant_context) @ X_HG
        for frame, X_HG in _goals_in_frames(scene, task)
    )
    return [list(itertools.islice(found, len(goal.poses))) for goal in task.goals]


def _goals_in_frames(scene: Scene, task: Task) -> list[tuple[Frame, RigidTransform]]:
    """Return the body frame H of each pose of the goals, and the pose X_HG in it.

    Raises:
        UnknownNameError: If the environment has no such body frame.
    """
    frames = scene.built.body_frames
    found = []
    for i, goal in enumerate(task.goals):
        for pose in goal.poses:
            if pose.body_frame not in frames:
                named = f"task '{task.name}', goal {i + 1}"
                where = f"{named}, environment '{scene.spec.environment.name}'"
                raise UnknownNameError("frame", pose.body_frame, frames, where=where)
            X_HG = RigidTransform(Quaternion(pose.quaternion), pose.position)
            found.append((frames[pose.body_frame], X_HG))
    return found


def _names(parts: list[Part]) -> tuple[str, ...]:
    """Return the names of the parts without repetitions, in order of appearance."""
    return tuple(dict.fromkeys(part.name for part in parts))


def _shapes(scene: Scene, parts: list[Part], names: tuple[str, ...], states: FloatArray) -> Shapes:
    """Return shapes at poses of shape (states, parts, 3, 4)."""
    inspector = scene.built.scene_graph.model_inspector()
    types_and_sizes = [shape_of(inspector, part) for part in parts]
    index = {name: i for i, name in enumerate(names)}
    return Shapes(
        type=np.array([code for code, _ in types_and_sizes], dtype=np.int8),
        size=np.array([size for _, size in types_and_sizes], dtype=np.float64).reshape(-1, 3),
        pad=np.array([part.pad for part in parts], dtype=np.float64),
        body=np.array([index[part.name] for part in parts], dtype=np.int16),
        frame=np.array([part.carrier for part in parts], dtype=np.int8),
        R=_rotations(states),
        p=_origins(states),
    )


def _matrices(states: list[list[RigidTransform]]) -> FloatArray:
    """Return poses as matrices, shape (states, poses, 3, 4)."""
    count = len(states[0]) if states else 0
    return _stacked([[X.GetAsMatrix34() for X in poses] for poses in states], count)


def _stacked(states: Sequence[Sequence[FloatArray] | FloatArray], count: int) -> FloatArray:
    return np.array(states, dtype=np.float64).reshape(len(states), count, 3, 4)


def _rotations(poses: FloatArray) -> FloatArray:
    """Return the rotations of poses, shape (states, poses, 3, 3)."""
    return np.ascontiguousarray(poses[..., :3])


def _origins(poses: FloatArray) -> FloatArray:
    """Return the origins of poses, shape (states, poses, 3)."""
    return np.ascontiguousarray(poses[..., 3])


def _transform(R: FloatArray, p: FloatArray) -> RigidTransform:
    return RigidTransform(RotationMatrix(R), p)
