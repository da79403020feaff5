"""The scene in space at a base pose, against Drake."""

from __future__ import annotations

import numpy as np
import pytest

import tcs
from tcs.errors import SelectionError
from tcs.model.scene import goal_poses
from tcs.placement.scoring import rebuild_scenes
from tcs.service import Engine, PostureRequest
from tests.environments import CORNER, write_environment

# What is tested is what happens in the processes, or put in its place.
pytestmark = pytest.mark.usefixtures("in_process")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("postures")
    environment = write_environment(folder, "corner", CORNER)
    tcs.save(folder / "corner.tcs", tcs.score("shaving", environment=str(environment), paper=True))
    return folder / "corner.tcs"


@pytest.fixture(scope="module")
def held(path):
    with Engine() as engine:
        yield engine, engine.open_file(path).file, tcs.load(path)


def here_of(file, index):
    member = file.configurations.configuration(index)
    here = (member.base_x, member.base_y, float(np.degrees(member.base_yaw)))
    return {"here": here, "torso": member.torso}


def test_bodies_are_where_drake_has_them_and_the_arm_is_at_the_goal(held):
    engine, digest, file = held
    scores = file.nominal.scores
    index = int(np.argmax(scores.reached.sum(axis=1)))
    goal = int(np.flatnonzero(scores.reached[index])[-1])
    found = engine.posture(PostureRequest(file=digest, goal=goal, **here_of(file, index)))
    assert (found["configuration"], found["goal"]) == (index, goal)
    job, scene, _ = rebuild_scenes(file)[0]
    member = file.configurations.configuration(index)
    scene.place_base(member.base_x, member.base_y, member.base_yaw)
    scene.set_torso(member.torso)
    scene.set_arm(scores.joints_of(index, goal))
    plant = scene.built.plant
    checked = 0
    for shape in found["shapes"]:
        part = next((p for p in scene.built.parts if p.name == shape["name"]), None)
        assert part is not None
        if sum(p.name == shape["name"] for p in scene.built.parts) > 1:
            continue
        X_WB = plant.EvalBodyPoseInWorld(scene.plant_context, plant.get_body(part.body))
        at = found["frames"][0][shape["body"]][:3]
        # Positions are rounded to four decimals.
        np.testing.assert_allclose(at, X_WB.translation(), atol=1e-4)
        checked += 1
    assert checked > 10
    goals = [X.translation() for X in goal_poses(scene, job.task)]
    np.testing.assert_allclose(np.array(found["goals"])[:, :3], goals, atol=1e-4)
    # The tool is at the goal, and the links of the gripper are a hand's length behind it.
    arm = {shape["body"] for shape in found["shapes"] if shape["category"] == "arm"}
    near = min(np.linalg.norm(np.array(found["frames"][0][b][:3]) - goals[goal]) for b in arm)
    assert near < 0.2


def test_frames_of_a_motion(held):
    engine, digest, file = held
    arm = [[0.0] * 7, [0.3] * 7, [0.0] * 7]
    found = engine.posture(PostureRequest(file=digest, arm=arm, **here_of(file, 0)))
    first, second, third = (np.array(frame) for frame in found["frames"])
    np.testing.assert_array_equal(first, third)
    moved = np.abs(first - second).max(axis=1) > 1e-3
    categories = {s["category"] for s in found["shapes"] if moved[s["body"]]}
    # Shapes of fixed bodies stay.
    assert categories == {"arm"}


def test_what_cannot_be_shown(held):
    engine, digest, file = held
    for request, message in (({"goal": 8}, "no goal 8"), ({"arm": [[0.0]]}, "7 values")):
        with pytest.raises(SelectionError, match=message):
            engine.posture(PostureRequest(file=digest, **request, **here_of(file, 0)))
