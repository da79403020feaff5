"""Drake plant of a robot alone that finds its self-collisions, by primitives or by mesh hulls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    CollisionFilterManager,
    Convex,
    Cylinder,
    GeometryId,
    GeometrySet,
    PenetrationAsPointPair,
    ProximityProperties,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant

from tcs.model.diagrams import diagram_builder
from tcs.model.robots.extras import model_with_extras, robot_urdf
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Geometry, Urdf
from tcs.model.robots.urdf.meshes import as_obj
from tcs.model.robots.urdf.surfaces import surface_geometries, welded_top

FloatArray = NDArray[np.float64]
BodyPair = tuple[str, str]
DRAWS = 500
"""Random postures that the search for a collision-free one tries."""


class SelfCollision:
    """A Drake plant of a robot alone that finds the pairs of bodies in contact.

    It compares every pair of bodies that are not welded together, disabled or not.
    """

    def __init__(self, robot: RobotFile, *, hulls: bool = False) -> None:
        """Build the plant, every joint at the middle of its limits.

        Args:
            robot: The robot.
            hulls: Compare the convex hulls of the original geometry instead of the primitives.

        Raises:
            RobotError: If the robot's model cannot be used.
        """
        model = robot.model()
        builder = diagram_builder()
        # A continuous plant: nothing is simulated.
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
        Parser(plant).AddModelsFromString(robot_urdf(robot), "urdf")
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName(robot.root_body))
        add = _Adder(plant)
        if hulls:
            _add_hulls(add, model)
        for primitive in robot.load_primitives():
            # Extra bodies have no mesh, so their primitives are used.
            if not hulls or primitive.body not in model.links:
                add.primitive(primitive if hulls else primitive.shrunk(-robot.self_margin / 2))
        plant.Finalize()
        self._bodies = add.bodies
        self._of_body: dict[str, list[GeometryId]] = {}
        for geometry, body in add.bodies.items():
            self._of_body.setdefault(body, []).append(geometry)
        _compare_unwelded(scene_graph.collision_filter_manager(), self._bodies, robot)
        joints = (plant.get_joint(index) for index in plant.GetJointIndices())
        self._starts = {j.name(): j.position_start() for j in joints if j.num_positions() == 1}
        self._deepest: dict[BodyPair, PenetrationAsPointPair] = {}
        self._followed: dict[BodyPair, list[tuple[GeometryId, GeometryId]]] = {}
        self._plant = plant
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._state = plant.GetMyMutableContextFromRoot(self._context)
        self._filter = scene_graph.collision_filter_manager(
            scene_graph.GetMyMutableContextFromRoot(self._context)
        )
        self._query_port = scene_graph.get_query_output_port()
        self._query_context = scene_graph.GetMyContextFromRoot(self._context)

    def touching(self, positions: Mapping[str, float]) -> frozenset[BodyPair]:
        """Return the pairs of bodies that touch, each sorted by name.

        Primitives touch when they come closer than the self margin of the robot, hulls when they
        overlap.

        Args:
            positions: Positions by joint [rad or m]; a joint left out keeps its position.
        """
        q = self._plant.GetPositions(self._state).copy()
        for name, value in positions.items():
            q[self._starts[name]] = value
        self._plant.SetPositions(self._state, q)
        self._deepest = {}
        for contact in self._query_port.Eval(self._query_context).ComputePointPairPenetration():
            pair = _pair(self._bodies[contact.id_A], self._bodies[contact.id_B])
            known = self._deepest.get(pair)
            if known is None or contact.depth > known.depth:
                self._deepest[pair] = contact
        return frozenset(self._deepest)

    def follow(self, pairs: Iterable[BodyPair]) -> None:
        """Compare only shapes of pairs that overlapped most, now or when followed before."""
        pairs = tuple(pairs)
        self.ignore(pairs)
        declaration = CollisionFilterDeclaration()
        for pair in pairs:
            contact = self._deepest[pair]
            self._followed.setdefault(pair, []).append((contact.id_A, contact.id_B))
            for first, second in self._followed[pair]:
                declaration.AllowBetween(GeometrySet(first), GeometrySet(second))
        self._filter.Apply(declaration)

    def compare(self, pairs: Iterable[BodyPair]) -> None:
        """Compare all shapes of pairs of bodies that were left out or followed."""
        declaration = CollisionFilterDeclaration()
        for first, second in pairs:
            declaration.AllowBetween(self._geometries(first), self._geometries(second))
        self._filter.Apply(declaration)

    def ignore(self, pairs: Iterable[BodyPair]) -> None:
        """Leave out pairs of bodies from now on: those that always touch take most time."""
        declaration = CollisionFilterDeclaration()
        for first, second in pairs:
            declaration.ExcludeBetween(self._geometries(first), self._geometries(second))
        self._filter.Apply(declaration)

    def ignore_within(self, bodies: Iterable[str]) -> None:
        """Leave out all pairs of given bodies from now on."""
        within = CollisionFilterDeclaration().ExcludeWithin(self._geometries(*bodies))
        self._filter.Apply(within)

    def ignore_unscored(self, model: Urdf, arm_joints: tuple[str, ...]) -> None:
        """Leave out the pairs that scoring does not check: without the arm, and within the hand.

        Args:
            model: The robot with its extra bodies.
            arm_joints: The scored arm, from base to tool.
        """
        moved, hand = (model.links_moved_by(arm_joints[i]) for i in (0, -1))
        self.ignore_within(self.bodies - moved)
        self.ignore_within(hand)

    @property
    def bodies(self) -> frozenset[str]:
        """Names of the bodies that have shapes."""
        return frozenset(self._bodies.values())

    def _geometries(self, *bodies: str) -> GeometrySet:
        return GeometrySet([g for body in bodies for g in self._of_body.get(body, ())])


class _Adder:
    """Registers collision shapes and records the body of each."""

    def __init__(self, plant: MultibodyPlant) -> None:
        self.plant = plant
        self.bodies: dict[GeometryId, str] = {}

    def primitive(self, primitive: Primitive) -> None:
        rotation = RotationMatrix(primitive.rotation)
        classes: dict[str, type[Sphere] | type[Capsule] | type[Box]] = {
            "sphere": Sphere,
            "capsule": Capsule,
            "box": Box,
        }
        shape = classes[primitive.kind](*primitive.size)
        self.shape(primitive.body, RigidTransform(rotation, primitive.xyz), shape)

    def shape(self, body: str, X_BS: RigidTransform, shape: Shape) -> None:
        geometry = self.plant.RegisterCollisionGeometry(
            self.plant.GetBodyByName(body),
            X_BS,
            shape,
            f"{body} {len(self.bodies)}",
            ProximityProperties(),
        )
        self.bodies[geometry] = body


def _add_hulls(add: _Adder, model: Urdf) -> None:
    for body in model.links:
        for geometry in surface_geometries(model, body):
            pose = RigidTransform(RollPitchYaw(geometry.rpy), geometry.xyz)
            add.shape(body, pose, _hull_of(geometry))


def _hull_of(geometry: Geometry) -> Shape:
    if geometry.mesh is not None:
        obj: Path = as_obj(geometry.mesh)
        return Convex(str(obj), np.array(geometry.size))
    if geometry.shape == "box":
        return Box(*geometry.size)
    if geometry.shape == "sphere":
        return Sphere(*geometry.size)
    return Cylinder(*geometry.size)


def _compare_unwelded(
    manager: CollisionFilterManager, bodies: Mapping[GeometryId, str], robot: RobotFile
) -> None:
    """Compare neighbours across a joint, which Drake excludes by default, but no welded bodies."""
    model = robot.model()
    carriers = {extra.name: extra.parent for extra in (*robot.frames, *robot.bodies)}
    groups: dict[str, list[GeometryId]] = {}
    for geometry, body in bodies.items():
        while body in carriers:
            body = carriers[body]
        groups.setdefault(welded_top(model, body)[0], []).append(geometry)
    sets = [GeometrySet(group) for group in groups.values()]
    for i, first in enumerate(sets):
        for second in sets[i + 1 :]:
            manager.Apply(CollisionFilterDeclaration().AllowBetween(first, second))
        manager.Apply(CollisionFilterDeclaration().ExcludeWithin(first))


def _pair(first: str, second: str) -> BodyPair:
    return (first, second) if first <= second else (second, first)


def free_posture(robot: RobotFile, seed: int = 0) -> dict[str, float] | None:
    """Return a posture of the scored arm without self-collision in the pairs scoring checks [rad].

    The candidates are all joints at 0 or at the limit nearest to 0, the middle of every range, and
    random postures; the torso is at its lowest.

    Args:
        robot: The robot.
        seed: Seed of the draws.

    Returns:
        Positions by joint, empty if all joints may be at 0; None if every candidate collides.
    """
    limits = robot.joint_limits()
    plant, others = SelfCollision(robot), robot.joint_positions()
    plant.ignore_unscored(model_with_extras(robot), robot.arm_joints)
    plant.ignore(robot.disabled_pairs)
    bounded = {name: tuple(np.clip(limits[name], -np.pi, np.pi)) for name in robot.arm_joints}
    middle = {name: float(np.mean(pair)) for name, pair in bounded.items()}
    draws = (
        {name: sample[name] for name in robot.arm_joints}
        for sample in sample_positions(robot, DRAWS, seed)
    )
    for drawn in ({}, middle, *draws):
        # Rounded for the file, and still within the limits.
        arm = {name: float(np.clip(round(q, 4), *limits[name])) for name, q in drawn.items()}
        if not plant.touching(robot.with_mimics({**others, **arm})):
            return arm
    return None


def sample_positions(robot: RobotFile, count: int, seed: int) -> list[dict[str, float]]:
    """Return postures drawn uniformly within the limits in force of every joint [rad or m].

    Arm, torso, head, other arm and grippers all move; mimic joints follow their leader, and
    continuous joints are drawn from one revolution.

    Args:
        robot: The robot.
        count: Number of postures.
        seed: Seed of the draws.
    """
    rng = np.random.default_rng(seed)
    joints = robot.model().joints
    limits = robot.joint_limits()
    free = [name for name in limits if joints[name].mimic is None]
    lower = np.array([max(limits[name][0], -np.pi) for name in free])
    upper = np.array([min(limits[name][1], np.pi) for name in free])
    return [
        robot.with_mimics(dict(zip(free, map(float, draw), strict=True)))
        for draw in rng.uniform(lower, upper, size=(count, len(free)))
    ]
