"""Boxes around groups, compared without being placed: what is apart is so by all corners."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BOX
from tcs.kernel.cache import jit
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE
from tcs.kernel.motion.near_pairs import boxes_apart, take_frames
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace
from tests.kernel.arms import drake_arm
from tests.kernel.motion.test_separating_planes import corners
from tests.kernel.motion.toys import toy
from tests.kernel.shapes import rotation


@jit
def apart(scene: MotionScene, work: MotionWorkspace, i: int, j: int, distance: float) -> bool:
    take_frames(scene, work, i, j)
    return boxes_apart(scene, work, i, j, distance)


def random_box(rng, row):
    row[TYPE] = BOX
    row[SIZE : SIZE + 3] = rng.uniform(0.02, 0.3, 3)
    row[BOUND] = np.linalg.norm(row[SIZE : SIZE + 3])
    row[CENTRE : CENTRE + 3] = rng.uniform(-0.5, 0.5, 3)


def test_a_face_separates_boxes_that_are_apart_and_no_others(rng):
    scene, work, _ = toy(drake_arm("pr2 left").chain, 0)
    i, j = 0, len(scene.shapes.links)
    frame, outcomes = scene.shapes.link_frame[i], []
    for _ in range(4000):
        random_box(rng, scene.shapes.links[i])
        random_box(rng, work.posture.shapes[j])
        scene.shapes.links[i, ROTATION:] = np.eye(3).ravel()
        work.posture.shapes[j, ROTATION:] = rotation(rng).ravel()
        work.posture.link_R[frame], work.posture.link_p[frame] = (
            rotation(rng),
            rng.uniform(-0.3, 0.3, 3),
        )
        first = (
            corners(scene.shapes.links[i][None])[0] @ work.posture.link_R[frame].T
            + work.posture.link_p[frame]
        )
        second = corners(work.posture.shapes[j][None])[0]
        normals = np.concatenate(
            [work.posture.link_R[frame], work.posture.shapes[j, ROTATION:].reshape(3, 3)], 1
        )
        a, b = first @ normals, second @ normals
        gap = np.max(np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)))
        distance = rng.choice([0.0, 0.05])
        if abs(gap - distance) > 1e-12:
            outcomes.append(gap > distance)
            assert apart(scene, work, i, j, distance) == outcomes[-1]
    assert 400 < np.sum(outcomes) < 3600
