"""Virtual walls: boxes that paths keep out of, as arrays for the kernel, as obstacles for Drake."""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BOX, FloatArray
from tcs.model.scene import LoweredScene, Scene, SceneSpec
from tcs.model.scene.contacts import Group
from tcs.model.scene.environment.environment_file import Obstacle
from tcs.model.scene.environment.shapes import named_shapes
from tcs.model.tasks import KeepOut, Task
from tcs.placement.scoring.job import Job

NAME = "keep_out"
"""Name of the body of the boxes in results, followed by their number."""


def with_keep_out(lowered: LoweredScene, task: Task) -> LoweredScene:
    """Return a lowered scene in which the arm, and nothing else, must not touch the boxes.

    The poses of the boxes follow from those of goals in the same body frames.

    Args:
        lowered: The scene.
        task: Its task.
    """
    arrays, boxes = lowered.arrays, task.keep_out
    poses = [_poses(lowered, task, one) for one in boxes]
    count, old = len(boxes), arrays.environment
    bodies = len(lowered.environment_bodies)
    environment = old._replace(
        type=np.append(old.type, np.full(count, BOX, old.type.dtype)),
        size=np.concatenate([old.size, 0.5 * np.array([one.box for one in boxes])]),
        pad=np.append(old.pad, np.zeros(count)),
        body=np.append(old.body, np.arange(bodies, bodies + count, dtype=old.body.dtype)),
        frame=np.append(old.frame, np.zeros(count, old.frame.dtype)),
        R=np.concatenate([old.R, np.stack([R for R, _ in poses], axis=1)], axis=1),
        p=np.concatenate([old.p, np.stack([p for _, p in poses], axis=1)], axis=1),
    )
    arm, body = len(arrays.arm.type), len(arrays.body.type)
    arrays = arrays._replace(
        environment=environment,
        arm_vs_environment=np.hstack([arrays.arm_vs_environment, np.ones((arm, count), bool)]),
        body_vs_environment=np.hstack([arrays.body_vs_environment, np.zeros((body, count), bool)]),
    )
    names = (*lowered.environment_bodies, *(f"{NAME}_{n}" for n in range(count)))
    return dataclasses.replace(lowered, arrays=arrays, environment_bodies=names)


def _poses(lowered: LoweredScene, task: Task, box: KeepOut) -> tuple[FloatArray, FloatArray]:
    """Return orientations (states, 3, 3) and centres (states, 3) [m] of a box in W."""
    number = [pose.body_frame for pose in task.poses].index(box.body_frame)
    goal = task.poses[number]
    R_HG = Rotation.from_quat(goal.quaternion, scalar_first=True).as_matrix()
    R_WH = lowered.arrays.goal_R[:, number] @ R_HG.T
    offset = np.array(box.position) - goal.position
    return R_WH, lowered.arrays.goal_p[:, number] + R_WH @ offset


def spec_with_keep_out(job: Job, scene: Scene) -> SceneSpec:
    """Return the robot, and the environment with the boxes as obstacles where they are now.

    Args:
        job: The job.
        scene: Its live scene, at a stop.
    """
    robot, environment = job.spec.robot, job.spec.environment
    boxes = []
    for number, one in enumerate(job.task.keep_out):
        X_WH = scene.body_frame_pose(one.body_frame)
        rpy = X_WH.rotation().ToRollPitchYaw().vector()
        x, y, z = (X_WH @ np.array(one.position)).tolist()
        roll, pitch, yaw = np.degrees(rpy).tolist()
        boxes.append(
            Obstacle(
                name=f"{NAME}_{number}", xyz=(x, y, z), rpy_deg=(roll, pitch, yaw), box=one.box
            )
        )
    walled = environment.model_copy(update={"obstacles": (*environment.obstacles, *boxes)})
    return SceneSpec(robot, walled)


def scene_with_keep_out(job: Job, scene: Scene) -> Scene:
    """Return a new live scene in which the boxes are obstacles to the arm, in the same state.

    Args:
        job: The job.
        scene: Its live scene, at a stop.
    """
    spec = spec_with_keep_out(job, scene)
    others = {part.name for part in scene.built.parts if part.group is Group.BODY}
    walls = [name for name in named_shapes(spec.environment)[0] if name.startswith(NAME)]
    allowed = [*job.task.allowed_contacts, *((body, wall) for body in others for wall in walls)]
    copy = Scene(spec, allowed_contacts=allowed)
    copy.restore(scene.positions())
    return copy
