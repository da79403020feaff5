"""Collision shapes of an environment without a robot, read off its Drake plant."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph

from tcs.kernel.arrays import Shapes
from tcs.model.diagrams import diagram_builder
from tcs.model.scene.contacts import shape_of
from tcs.model.scene.environment.environment_file import EnvironmentFile
from tcs.model.scene.environment.plant import add_environment, environment_parts


def environment_shapes(environment: EnvironmentFile) -> Shapes:
    """Return the collision shapes of an environment; see `named_shapes`."""
    return named_shapes(environment)[1]


def named_shapes(environment: EnvironmentFile) -> tuple[tuple[str, ...], Shapes]:
    """Return the collision shapes of an environment in the state of its file, in W.

    Args:
        environment: The environment.

    Returns:
        The name of each under which its contacts are reported, and the shapes in one state; the
        bodies are numbered in the order of the shapes.

    Raises:
        EnvironmentFileError: If a model cannot be used, or a shape is not supported.
        UnknownNameError: If the file names something that does not exist.
    """
    builder = diagram_builder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    added = add_environment(plant, environment)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    parts = environment_parts(plant, inspector, added, environment)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    found = [shape_of(inspector, part) for part in parts]
    poses = np.array([query.GetPoseInWorld(part.geometry).GetAsMatrix34() for part in parts])
    poses = poses.reshape(1, len(parts), 3, 4)
    names = tuple(part.name for part in parts)
    return names, Shapes(
        type=np.array([code for code, _ in found], dtype=np.int8),
        size=np.array([size for _, size in found], dtype=np.float64).reshape(-1, 3),
        pad=np.array([part.pad for part in parts], dtype=np.float64),
        body=np.arange(len(parts), dtype=np.int16),
        frame=np.zeros(len(parts), dtype=np.int8),
        R=np.ascontiguousarray(poses[..., :3]),
        p=np.ascontiguousarray(poses[..., 3]),
    )
