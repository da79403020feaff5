"""Virtual walls: paths keep out of them, straight motions do not, and Drake judges both."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

import tcs
from tcs.errors import TaskError, TcsError, UnknownNameError
from tcs.kernel.motion.edges import posture_contact
from tcs.model.tasks import KeepOut, load_task
from tcs.motion import Stop
from tcs.motion.keep_out import scene_with_keep_out
from tcs.motion.recheck import StopCheck
from tcs.placement.scoring.rebuild import rebuild_scenes
from tests.exact import exact_content


@pytest.fixture(scope="module")
def stop(two_goals):
    job, scene, _ = rebuild_scenes(tcs.load(two_goals))[0]
    return Stop.of(job, scene, 0, seed=0)


@pytest.mark.parametrize("task", ["shaving", "feeding", "brushing"])
def test_tasks_at_the_head_keep_out_of_the_space_before_the_face(task):
    (wall,) = load_task(task).keep_out
    assert wall.body_frame == "head"
    assert load_task("bathing").keep_out == ()


def test_the_wall_counts_on_paths_alone(planned, stop):
    approach = planned.stops[0].segments[1]
    at_goal, before = approach.curve.q[-1], approach.curve.q[0]
    assert stop.contact_at(at_goal)[1] == "keep_out_0"
    assert stop.contact_at(before) is None
    assert posture_contact(stop.lines, stop.line_work, at_goal) == -1


def test_kernel_and_drake_have_the_same_wall(stop, rng):
    walled = scene_with_keep_out(stop.job, stop.scene)
    lower, upper = walled.arm_limits
    lower, upper = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    touched = 0
    for _ in range(30):
        q = rng.uniform(lower, upper)
        walled.set_arm(q)
        found = [contact for contact in walled.violations() if contact[1].startswith("keep_out")]
        if any(abs(contact[2]) < 1e-5 for contact in found):
            continue
        names = stop.contact_at(q)
        assert (names is not None) == bool(walled.violations())
        touched += bool(found)
    assert touched > 0


def test_drake_refutes_a_path_through_the_wall(planned, stop):
    check = StopCheck(stop)
    approach = planned.stops[0].segments[1]
    assert check.false_pieces(approach) == 0
    as_path = type(approach)("move", None, 0, approach.timing)
    assert check.false_pieces(as_path) > 0


def test_the_scene_with_walls_serves_again_where_they_are_the_same(stop):
    scene, first = stop.scene, StopCheck(stop)
    before = scene.positions()
    scene.place_base(1.0, -0.5, 0.3)
    again = StopCheck(stop, first)
    assert again._paths is first._paths
    np.testing.assert_array_equal(again._paths.scene.positions(), scene.positions())
    # The person's head takes the wall along.
    scene.set_joint("wheelchair_x", 0.05)
    elsewhere = StopCheck(stop, again)
    assert elsewhere._paths is not again._paths
    scene.restore(before)


def shaving_with(change, path):
    task = exact_content("shaving")
    change(task["keep_out"][0])
    path.write_text(yaml.safe_dump(task))
    return path


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda wall: wall.update(box=[1, 2]), TaskError, r"keep_out\[0\].box"),
        (lambda wall: wall.update(box=[0.1, 0.2, -1.0]), TaskError, "box"),
        (lambda wall: wall.update(position=[0, 0, 99.0]), TaskError, "position"),
        (lambda wall: wall.update(body_frame="knee"), UnknownNameError, "keep_out"),
        (lambda wall: wall.update(colour="red"), TcsError, "colour"),
    ],
)
def test_impossible_walls_are_one_line(tmp_path, change, error, message):
    with pytest.raises(error, match=message) as found:
        load_task(shaving_with(change, tmp_path / "task.yaml"))
    assert len(str(found.value).splitlines()) == 1


def test_a_wall_has_a_frame():
    with pytest.raises(TaskError, match="body_frame"):
        KeepOut("", (0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
