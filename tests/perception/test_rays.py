"""Ray casting, judged by Drake: along a ray, its point distances lead to the same point."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from tcs.errors import EnvironmentFileError
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, Shapes
from tcs.model.scene import environment_shapes, load_environment
from tcs.model.scene.environment.plant import add_environment
from tcs.perception import PlanarPose, load_table
from tcs.perception.rays import cast
from tcs.perception.simulation import with_table

LONGEST = 6.0


def traced(environment, origin, directions):
    """Return the distance along each ray by sphere tracing with Drake's point distances."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    add_environment(plant, environment)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    found = []
    for direction in directions:
        along = 0.0
        for _ in range(2000):
            near = query.ComputeSignedDistanceToPoint(origin + along * direction)
            distance = min((each.distance for each in near), default=np.inf)
            along += distance
            if distance < 1e-9 or along > LONGEST:
                break
        found.append(along if along <= LONGEST else np.inf)
    return np.array(found)


@pytest.mark.parametrize("name", ["wheelchair", "bed"])
def test_ranges_are_those_of_drake(name):
    environment = load_environment(name)
    environment = with_table(environment, load_table("thesis"), PlanarPose(-1.2, 0.9, 0.4))
    shapes = environment_shapes(environment)
    rng = np.random.default_rng(0)
    origin = np.array([-2.0, -0.4, 0.55])
    tilts, headings = rng.uniform(-0.15, 0.1, 25), rng.uniform(-0.9, 0.9, 25)
    directions = np.column_stack(
        [np.cos(tilts) * np.cos(headings), np.cos(tilts) * np.sin(headings), np.sin(tilts)]
    )
    mine = cast(origin, directions, shapes)
    drake = traced(environment, origin, directions)
    mine = np.where(mine > LONGEST, np.inf, mine)
    assert np.isfinite(drake).sum() > 8
    # Sphere tracing ends within 1e-9 m of a surface, and stops early along one that it grazes.
    np.testing.assert_allclose(mine, drake, atol=1e-6)


def one(code, size):
    """Return a single shape at the origin."""
    return Shapes(
        type=np.array([code], np.int8), size=np.array([size], dtype=float), pad=np.zeros(1),
        body=np.zeros(1, np.int16), frame=np.zeros(1, np.int8), R=np.eye(3)[None, None],
        p=np.zeros((1, 1, 3)),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("code", "size", "expected"),
    [(BOX, (0.5, 1, 1), 1.5), (SPHERE, (0.4, 0, 0), 1.6), (CAPSULE, (0.3, 0.5, 0), 1.7)],
    ids=["box", "sphere", "capsule"],
)
def test_a_ray_ahead_meets_a_shape_and_one_behind_does_not(code, size, expected):
    ahead, behind = np.eye(3)[:1], -np.eye(3)[:1]
    assert cast(np.array([-2.0, 0, 0]), ahead, one(code, size))[0] == pytest.approx(expected)
    assert cast(np.array([-2.0, 0, 0]), behind, one(code, size))[0] == np.inf
    assert cast(np.zeros(3), ahead, one(code, size))[0] == 0.0


def test_a_ray_within_a_face_is_no_error():
    at = cast(np.array([-2.0, 1.0, 0.0]), np.eye(3)[:1], one(BOX, (0.5, 1.0, 1.0)))
    assert at[0] in (1.5, np.inf)


def test_a_taken_name_is_refused():
    table = load_table("thesis")
    once = with_table(load_environment("wheelchair"), table, PlanarPose(2.0, 0.0, 0.0))
    with pytest.raises(EnvironmentFileError, match="used twice"):
        with_table(once, table, PlanarPose(3.0, 0.0, 0.0))
