"""The gripper at every goal: where the original meshes are free, our shapes are free too."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from tcs.kernel.arrays import BOX, CAPSULE
from tcs.scene import Scene, SceneSpec, lower
from tcs.scene.room import add_room, room_parts
from tcs.tasks import load_task

DATA = Path(__file__).parents[1] / "data"
with (DATA / "goal_clearance_chair.csv").open(encoding="utf-8") as file:
    ROWS = list(csv.DictReader(file))


class FloatingGripper:
    """The lowered gripper (arm shapes of frame 7) alone in the wheelchair environment."""

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
        self.room = add_room(self.plant, environment)
        self.plant.Finalize()
        inspector = graph.model_inspector()
        self.parts = room_parts(self.plant, inspector, self.room, environment)
        self.margin = environment.contact_margin
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.state = self.plant.GetMyContextFromRoot(self.context)

    def clearances(self, goal_R, goal_p):
        """Least (clearance, required, name) to the person and to everything else."""
        X_WG = RigidTransform(RotationMatrix(goal_R), goal_p)
        self.plant.SetFreeBodyPose(self.state, self.tool, X_WG)
        query = self.plant.get_geometry_query_input_port().Eval(self.state)
        least = {}
        for part in self.parts:
            kind = "person" if part.name.startswith("person::") else "furniture"
            required = max(self.margin, part.pad)
            for shape in self.shapes:
                found = query.ComputeSignedDistancePairClosestPoints(shape, part.geometry)
                entry = (found.distance - required, found.distance, required, part.name)
                least[kind] = min(least.get(kind, entry), entry)
        return least


def drake_shape(shapes, i):
    a, b, c = shapes.size[i]
    if shapes.kind[i] == BOX:
        return Box(2 * a, 2 * b, 2 * c)
    return Capsule(a, 2 * b) if shapes.kind[i] == CAPSULE else Sphere(a)


@pytest.fixture(scope="module", params=["open", "closed"])
def gripper(request, pr2, wheelchair, full_grid):
    robot = pr2.with_choices(gripper=request.param)
    scene = Scene(SceneSpec(robot, wheelchair))
    lowered = {
        name: lower(scene, load_task(name), full_grid)
        for name in ("shaving", "feeding", "brushing")
    }
    return request.param, lowered, FloatingGripper(lowered["shaving"], wheelchair)


def test_every_goal_is_compared(gripper):
    _, lowered, _ = gripper
    expected = {(row["task"], row["goal"]) for row in ROWS}
    got = {(task, str(i)) for task, scene in lowered.items() for i in range(len(scene.goals))}
    assert got == expected
    assert len(got) == 23


@pytest.mark.parametrize("task", ["shaving", "feeding", "brushing"])
def test_a_goal_that_is_free_in_the_meshes_is_free_here(gripper, task):
    finger, lowered, floating = gripper
    arrays = lowered[task].arrays
    rows = [row for row in ROWS if row["task"] == task and row["finger"] == finger]
    blocked, optimistic = [], []
    for row in rows:
        i = int(row["goal"])
        least = floating.clearances(arrays.goal_R[0, i], arrays.goal_p[0, i])
        mesh = {"person": float(row["person_dist"]), "furniture": float(row["furniture_dist"])}
        for kind, (_, clearance, required, name) in least.items():
            if row["colliding"] == "no" and clearance < required:
                blocked.append((i, name, clearance, required, mesh[kind]))
            # What the shapes leave out of the skin is at most the padding, so with the padding
            # taken off they are never farther away than the meshes. 0.1 mm: the table's rounding.
            if clearance - required > mesh[kind] + 1e-4 and kind == "person":
                optimistic.append((i, name, clearance, required, mesh[kind]))
    assert blocked == []
    assert optimistic == []


def test_the_table_in_the_documentation_is_todays(gripper):
    finger, lowered, floating = gripper
    text = (Path(__file__).parents[2] / "docs" / "scene.md").read_text(encoding="utf-8")
    number = r"(-?[\d.]+)"
    row = rf"\| (\w+) (\d) \| {number} \| {number} \| {number} \| {number} \|"
    found = re.findall(row, text)
    assert len(found) == 23
    for task, goal, *written in found:
        arrays, i = lowered[task].arrays, int(goal)
        least = floating.clearances(arrays.goal_R[0, i], arrays.goal_p[0, i])
        here = float(written[1 if finger == "open" else 3])
        # The table has a tenth of a millimetre.
        assert 1e3 * least["person"][1] == pytest.approx(here, abs=0.1), (task, goal)
