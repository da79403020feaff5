"""Environments without a robot, and the exposed skin of the person in them."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from pydrake.geometry import Box
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from tcs.model.scene.environment.environment_file import EnvironmentFile, load_environment
from tcs.model.scene.environment.plant import add_environment, environment_parts

DATA = Path(__file__).parents[2] / "data"
PROBE_RADIUS = 0.015
"""Skin counts as exposed where a sphere of 30 mm diameter can touch it [m]."""


def rows(name):
    with (DATA / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers(row, *columns):
    return np.array([float(row[column]) for column in columns])


class EnvironmentAlone:
    """An environment in a plant without a robot."""

    def __init__(self, environment):
        is_file = isinstance(environment, EnvironmentFile)
        self.file = environment if is_file else load_environment(environment)
        builder = DiagramBuilder()
        self.plant, graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        self.added = add_environment(self.plant, self.file)
        self.plant.Finalize()
        self.inspector = graph.model_inspector()
        self.parts = environment_parts(self.plant, self.inspector, self.added, self.file)
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.state = self.plant.GetMyContextFromRoot(self.context)
        self.default = self.plant.GetPositions(self.state).copy()

    def set(self, **joints):
        """Set these joints and what follows them, and all others as the file says."""
        q = self.default.copy()
        for name, value in joints.items():
            for joint, at in self.added.joints.positions(name, value, where="the test"):
                q[joint.position_start()] = at
        self.plant.SetPositions(self.state, q)

    def pose(self, link, **joints):
        """Pose of "model::link" in W with these joints set."""
        self.set(**joints)
        X_WL = self.added.links[link].EvalPoseInWorld(self.state)
        self.set()
        return X_WL

    def query(self):
        return self.plant.get_geometry_query_input_port().Eval(self.state)

    def reach(self, *names):
        """Lower and upper corner in W of the smallest box around some boxes."""
        corners = []
        for part in self.parts:
            if part.name in names:
                box = self.inspector.GetShape(part.geometry)
                assert isinstance(box, Box)
                half = np.array([box.width(), box.depth(), box.height()]) / 2
                X_WG = self.query().GetPoseInWorld(part.geometry)
                around = np.abs(X_WG.rotation().matrix()) @ half
                corners += [X_WG.translation() - around, X_WG.translation() + around]
        assert len(corners) == 2 * len(names)
        return np.min(corners, axis=0), np.max(corners, axis=0)

    def distances_to_links(self, point):
        """Signed distance from a point to the nearest shape of each body link."""
        name_of = {part.geometry: part.name for part in self.parts}
        least = {}
        for found in self.query().ComputeSignedDistanceToPoint(point):
            name = name_of[found.id_G]
            if name.startswith("person::"):
                least[name] = min(found.distance, least.get(name, np.inf))
        return least

    def exposed_skin(self):
        """Exposed skin points: link, and the distance to every link's shapes."""
        exposed = []
        for row in rows("person_surface.csv"):
            link = f"person::{row['link']}"
            X_WL = self.added.links[link].EvalPoseInWorld(self.state)
            point = X_WL @ numbers(row, "x", "y", "z")
            normal = X_WL.rotation() @ numbers(row, "nx", "ny", "nz")
            # The meshes reach into one another with slots and sockets that nothing ever meets.
            # Points inside another part are such places, and so are points a sphere cannot touch
            # because another part is in its way.
            others = self.distances_to_links(point + PROBE_RADIUS * normal)
            others.pop(link)
            if min(others.values()) >= PROBE_RADIUS:
                exposed.append((link, self.distances_to_links(point)))
        return exposed
