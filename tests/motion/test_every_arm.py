"""Plans of arms of every class: re-checked by Drake, and with the joints of the arm alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

import tcs
from tcs.motion import check_plan, evaluate_plan, load_plan, save_plan
from tests.exact import exact_content

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SHAVING = exact_content("shaving")


def at(x, y, yaw, torso=0.0):
    return f"base_x = {x} m", f"base_y = {y} m", f"base_yaw = {yaw} deg", f"torso = {torso} m"


CASES = {
    "six joints": ("ur5", "wheelchair", SHAVING, 0, at(1.0, -0.6, 0), "shoulder_pan_joint"),
    "prismatic joints": ("stretch", "wheelchair", SHAVING, 2, at(1.1, 0.6, 315), "drive"),
    "five joints, free goal": (
        EXAMPLES / "so101.yaml",
        EXAMPLES / "arm_on_the_table.yaml",
        yaml.safe_load((EXAMPLES / "feeding_from_any_side.yaml").read_text()),
        0,
        at(0.78, 0.2, 180),
        "shoulder_pan",
    ),
}
"""Robot, environment, task, goal, configuration, and first joint."""


@pytest.fixture(scope="module", params=CASES)
def planned(request, tmp_path_factory):
    """The plan of one goal, and the name of the arm's first joint."""
    robot, environment, task, goal, only, first = CASES[request.param]
    path = tmp_path_factory.mktemp("arm") / f"{task['name']}.yaml"
    path.write_text(yaml.safe_dump({**task, "goals": [task["goals"][goal]]}))
    file = tcs.score(path, environment, robot, jobs=1, only=only, approach=False)
    return tcs.plan(file, [0]), first


def test_the_goal_is_done_and_drake_refutes_nothing(planned, tmp_path):
    plan, first = planned
    count = 5 if first == "shoulder_pan" else 6
    assert (plan.goals_done, plan.false, plan.joints[0], len(plan.joints)) == (1, 0, first, count)
    (stop,) = plan.stops
    assert stop.returns
    assert all(s.timing.positions.shape[1] == count for s in stop.segments)
    path = tmp_path / "plan.json"
    save_plan(path, plan)
    found = check_plan(load_plan(path))
    assert (found.is_sound, found.goals, found.edges) == (True, 1, plan.edges)


def test_its_motions_are_found_again_under_error(planned):
    found = evaluate_plan(planned[0], samples=2)
    assert found.replanned.shape == (2, 1)
    assert np.any(found.replanned)
