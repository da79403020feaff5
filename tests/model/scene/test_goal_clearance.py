"""The gripper at every goal: free here where it is free in the original meshes, and blocked too."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from tcs.kernel.arrays import BOX, CAPSULE
from tcs.model.grid import Grid
from tcs.model.scene import Scene, SceneSpec, load_environment, lower
from tcs.model.scene.environment.plant import add_environment, environment_parts
from tcs.model.tasks import load_task
from tests.model.scene.environments import rows

ROWS = {
    "wheelchair": rows("goal_clearance_chair.csv"),
    "bed": rows("goal_clearance_bed.csv"),
}
GOALS = {"wheelchair": 23, "bed": 36}
NOT_MET = {("scratching_chest", 1, "closed"), ("bathing", 13, "closed")}
"""Free in the meshes by 2.2 mm and blocked here by the padding of the chest, 9 mm; the two are the
same goal. With open fingers, as scored, it is free."""


class FloatingGripper:
    """The lowered gripper (arm shapes of frame 7) alone in an environment."""

    def __init__(self, lowered, environment):
        arm, chain = lowered.arrays.arm, lowered.arrays.chain
        X_TL7 = RigidTransform(RotationMatrix(chain.R[7]), chain.p[7]).inverse()
        builder = DiagramBuilder()
        self.plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.tool = self.plant.AddRigidBody("tool", self.plant.AddModelInstance("gripper"))
        self.shapes = []
        for i in np.flatnonzero(arm.frame == 7):
            X_LG = RigidTransform(RotationMatrix(arm.R[0, i]), arm.p[0, i])
            self.shapes.append(
                self.plant.RegisterCollisionGeometry(
                    self.tool, X_TL7 @ X_LG, drake_shape(arm, i), f"{i}", ProximityProperties()
                )
            )
        self.added = add_environment(self.plant, environment)
        self.plant.Finalize()
        inspector = graph.model_inspector()
        self.parts = environment_parts(self.plant, inspector, self.added, environment)
        self.margin = environment.contact_margin
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.state = self.plant.GetMyContextFromRoot(self.context)

    def set_joint(self, joint, position):
        q = self.plant.GetPositions(self.state).copy()
        for moved, at in self.added.joints.positions(joint, position, where="the test"):
            q[moved.position_start()] = at
        self.plant.SetPositions(self.state, q)

    def clearances(self, goal_R, goal_p):
        """Least (clearance, distance, required, name) to the person and to everything else."""
        X_WG = RigidTransform(RotationMatrix(goal_R), goal_p)
        self.plant.SetFreeBodyPose(self.state, self.tool, X_WG)
        query = self.plant.get_geometry_query_input_port().Eval(self.state)
        least = {}
        for part in self.parts:
            # The table knows no walls and no floor.
            kind = part.name.split("::")[0]
            required = max(self.margin, part.pad)
            for shape in self.shapes:
                found = query.ComputeSignedDistancePairClosestPoints(shape, part.geometry)
                entry = (found.distance - required, found.distance, required, part.name)
                least[kind] = min(least.get(kind, entry), entry)
        return least


def drake_shape(shapes, i):
    a, b, c = shapes.size[i]
    if shapes.type[i] == BOX:
        return Box(2 * a, 2 * b, 2 * c)
    return Capsule(a, 2 * b) if shapes.type[i] == CAPSULE else Sphere(a)


class Comparison:
    """The gripper at every goal of one environment, with fingers open or closed."""

    def __init__(self, robot, environment, finger):
        self.environment, self.finger = environment, finger
        loaded = load_environment(environment)
        scene = Scene(SceneSpec(robot.with_choices(gripper=finger), loaded))
        grid = Grid.from_spec(loaded.grid)
        tasks = sorted({row["task"] for row in ROWS[environment]})
        self.lowered = {task: lower(scene, load_task(task), grid) for task in tasks}
        self.gripper = FloatingGripper(self.lowered["shaving"], loaded)
        states = [""] if environment == "wheelchair" else ["bed0", "bed35", "bed70"]
        self.scenes = states
        self.at = {}
        for state, name in enumerate(states):
            if name:
                # The grid's first states are those of the lowest bed, one for each head rest.
                self.gripper.set_joint("head_rest", np.radians(float(name.removeprefix("bed"))))
            for task, lowered in self.lowered.items():
                arrays = lowered.arrays
                for i in range(len(lowered.goals)):
                    pose = arrays.goal_R[state, i], arrays.goal_p[state, i]
                    self.at[task, i, name] = self.gripper.clearances(*pose)

    @property
    def rows(self):
        """Row by row: task, goal, scene, result by the meshes, result here."""
        for row in ROWS[self.environment]:
            if row["finger"] == self.finger:
                scene = "" if self.environment == "wheelchair" else row["scene"]
                key = (row["task"], int(row["goal"]), scene)
                yield key, row, self.at[key]


@pytest.fixture(
    scope="module",
    params=[(row, finger) for row in ROWS for finger in ("open", "closed")],
    ids=" ".join,
)
def compared(request, pr2):
    return Comparison(pr2, *request.param)


def test_every_goal_is_compared(compared):
    expected = {key for key, *_ in compared.rows}
    assert expected == set(compared.at)
    assert len(expected) == GOALS[compared.environment] * len(compared.scenes)


def test_the_verdict_is_that_of_the_meshes(compared):
    wrong = []
    for (task, goal, scene), row, least in compared.rows:
        tightest = min(least.values())
        blocked = tightest[0] < 0
        if blocked != (row["colliding"] == "yes") and (task, goal, row["finger"]) not in NOT_MET:
            wrong.append((task, goal, scene, tightest))
    assert wrong == []


def test_goals_blocked_in_the_meshes_are_blocked_here(compared):
    for (task, goal, _), row, least in compared.rows:
        if (task, goal, row["finger"]) in NOT_MET:
            assert row["colliding"] == "no"
            _, distance, required, name = min(least.values())
            assert distance < required
            assert name == "person::upper_body_link"
            assert float(row["person_dist"]) < 0.003


def test_nothing_is_farther_away_than_in_the_meshes(compared):
    # What the shapes leave out of the skin is at most the padding, so with the padding taken off
    # they are never farther away than the meshes. 0.1 mm: the table's rounding.
    furniture = "wheelchair" if compared.environment == "wheelchair" else "bed"
    optimistic = []
    for key, row, least in compared.rows:
        for kind, mesh in (("person", row["person_dist"]), (furniture, row["furniture_dist"])):
            if least[kind][0] > float(mesh) + 1e-4:
                optimistic.append((key, least[kind], mesh))
    assert optimistic == []


def test_the_tables_in_the_documentation_are_todays(compared):
    text = (Path(__file__).parents[3] / "docs" / "scene.md").read_text(encoding="utf-8")
    chair, bed = text.split("### On the bed")
    number = r"(-?[\d.]+)"
    found = re.findall(
        rf"\| (\w+) (\d+) \| {number} \| {number} \| {number} \| {number} \|",
        chair if compared.environment == "wheelchair" else bed,
    )
    # Chest, forearms and so on are scratched where they are washed.
    compared_goals = {(task, i) for task, i, _ in compared.at if not task.startswith("scratching")}
    assert {(task, int(goal)) for task, goal, *_ in found} == compared_goals
    for task, goal, *written in found:
        meshes, here = written[:2] if compared.finger == "open" else written[2:]
        at_goal = [
            (least["person"], float(row["person_dist"]))
            for (name, i, _), row, least in compared.rows
            if (name, i) == (task, int(goal))
        ]
        # The table has a tenth of a millimetre.
        _, distance, _, _ = min(least for least, _ in at_goal)
        assert 1e3 * distance == pytest.approx(float(here), abs=0.1), (task, goal)
        assert 1e3 * min(mesh for _, mesh in at_goal) == pytest.approx(float(meshes), abs=0.06)


@pytest.mark.parametrize("part", ["upper_arm", "forearm", "thigh", "chest"])
def test_a_body_part_is_scratched_where_it_is_washed(part):
    washed = load_task("bathing").exact().goals
    sides = ("",) if part == "chest" else ("_left", "_right")
    for side in sides:
        goals = load_task(f"scratching_{part}{side}").exact().goals
        assert all(any(goal == other for other in washed) for goal in goals)
        assert {goal.body_frame for goal in goals} == {f"{part}{side}"}
