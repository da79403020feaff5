"""Drake's inverse kinematics and Drake's collision checker, on the smallest possible plant.

The plant is built from the lowered arrays: the environment and the other parts of the robot are
fixed, and only the joints that a problem varies are joints. On the full plant of the scene (40
positions) the same inverse kinematics takes about twice as long.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from peer_problems import Answer, Pair, start_limits, tries_filled
from pydrake.common import Parallelism
from pydrake.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import InverseKinematics
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.planning import RobotDiagramBuilder, SceneGraphCollisionChecker
from pydrake.solvers import SnoptSolver

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, Shapes
from tcs.model.scene import LoweredScene

INSIDE_POSITION, INSIDE_ROTATION = 5e-4, 5e-3
"""Half the tolerances of the judge [m, rad], a margin for the corners of the box and for
the tolerance of SNOPT."""
INFLUENCE = 0.01
"""Distance beyond the margin from which on Drake ignores a pair [m]. On a dozen reachable pairs and
up to five tries this took 22 ms on average, 5 mm took 350 ms and 100 mm 520 ms."""
BASE = ("base_x", "base_y", "base_yaw")
TRIES = (1, 5)
THREADS = 2


@dataclass(frozen=True, eq=False)
class ArmPlant:
    """The parts of the small plant.

    With joints, base and torso move on joints (for the collision checker); without, on frames
    whose poses are set (for inverse kinematics), so that the arm's joints are all there is.
    """

    base: Frame
    torso: Frame
    tool: Frame
    robot: ModelInstanceIndex


def add_arm(
    plant: MultibodyPlant, scene_graph: SceneGraph, lowered: LoweredScene, *, joints: bool
) -> ArmPlant:
    """Build and finalize the plant; Drake will check exactly the pairs that our kernel checks.

    Base against environment is left out without joints: there, nothing that moves takes part in it.
    """
    arrays = lowered.arrays
    robot = plant.AddModelInstance("robot")
    environment = plant.AddModelInstance("environment")
    inertia = SpatialInertia.SolidSphereWithMass(1.0, 0.1)
    axis = torso_axis(arrays.arm_base_p)
    if joints:
        parent = plant.world_frame()
        for name, along in zip(BASE, np.eye(3), strict=True):
            joint_class = RevoluteJoint if name == "base_yaw" else PrismaticJoint
            body = plant.AddRigidBody(name, robot, inertia)
            plant.AddJoint(joint_class(name, parent, body.body_frame(), along))
            parent = body.body_frame()
        torso = plant.AddRigidBody("torso", robot, inertia).body_frame()
        plant.AddJoint(PrismaticJoint("torso", parent, torso, axis))
        base = parent
    else:
        still = RigidTransform()
        base = plant.AddFrame(FixedOffsetFrame("base", plant.world_frame(), still, robot))
        torso = plant.AddFrame(FixedOffsetFrame("torso", base, still, robot))
    at = _pose(arrays.arm_base_R[0], arrays.arm_base_p[0])
    frame = plant.AddFrame(FixedOffsetFrame("arm_base", torso, at, robot))
    links = []
    for i in range(7):
        X = _pose(arrays.chain.R[i], arrays.chain.p[i])
        on = plant.AddFrame(FixedOffsetFrame(f"before_{i + 1}", frame, X, robot))
        link = plant.AddRigidBody(f"link_{i + 1}", robot, inertia)
        limits = arrays.chain.lower[i], arrays.chain.upper[i]
        joint = RevoluteJoint(f"arm_{i + 1}", on, link.body_frame(), np.eye(3)[2], *limits)
        plant.AddJoint(joint)
        links.append(link.body_frame())
        frame = link.body_frame()
    X = _pose(arrays.chain.R[7], arrays.chain.p[7])
    tool = plant.AddFrame(FixedOffsetFrame("tool", frame, X, robot))
    # The checker gives one result for each pair of bodies, so each named body is one body.
    bodies: dict[str, RigidBody] = {}

    def carrier(name: str, frame: Frame, instance: ModelInstanceIndex) -> RigidBody:
        # Drake reserves "::" for names within a model instance.
        key = f"{frame.name()} {name}".replace("::", " ")
        if key not in bodies:
            bodies[key] = plant.AddRigidBody(key, instance, inertia)
            plant.WeldFrames(frame, bodies[key].body_frame())
        return bodies[key]

    def on_link(k: int) -> RigidBody:
        name = lowered.robot_bodies[arrays.arm.body[k]]
        return carrier(name, links[arrays.arm.frame[k] - 1], robot)

    def on_body(k: int) -> RigidBody:
        name = lowered.robot_bodies[arrays.body.body[k]]
        return carrier(name, torso if arrays.body.frame[k] else base, robot)

    def in_environment(k: int) -> RigidBody:
        return carrier(
            lowered.environment_bodies[arrays.environment.body[k]], plant.world_frame(), environment
        )

    arm = _register(plant, arrays.arm, on_link, "arm")
    body = _register(plant, arrays.body, on_body, "body")
    obstacles = _register(plant, arrays.environment, in_environment, "environment")
    plant.Finalize()
    declaration = CollisionFilterDeclaration().ExcludeWithin(GeometrySet([*arm, *body, *obstacles]))
    for i, shape in enumerate(arm):
        partners = [arm[j] for j in np.flatnonzero(arrays.arm_vs_arm[i, :i])]
        partners += [body[j] for j in np.flatnonzero(arrays.arm_vs_body[i])]
        partners += [obstacles[j] for j in np.flatnonzero(arrays.arm_vs_environment[i])]
        _allow(declaration, shape, partners)
    if joints:
        for i, shape in enumerate(body):
            _allow(
                declaration,
                shape,
                [obstacles[j] for j in np.flatnonzero(arrays.body_vs_environment[i])],
            )
    scene_graph.collision_filter_manager().Apply(declaration)
    return ArmPlant(base, torso, tool, robot)


class DrakeIk:
    """Drake InverseKinematics with SNOPT from random starts within the joint limits."""

    def __init__(self, lowered: LoweredScene, *, distance: bool) -> None:
        """Build the plant; `distance` adds the minimum distance constraint to every problem."""
        title = "Drake IK, min distance" if distance else "Drake IK"
        self.labels = tuple(f"{title}, {n} {'try' if n == 1 else 'tries'}" for n in TRIES)
        self._distance = distance
        builder = RobotDiagramBuilder(time_step=0.0)
        self._parts = add_arm(builder.plant(), builder.scene_graph(), lowered, joints=False)
        self._diagram = builder.Build()
        self._plant = self._diagram.plant()
        self._root = self._diagram.CreateDefaultContext()
        self._context = self._plant.GetMyMutableContextFromRoot(self._root)
        arrays = lowered.arrays
        self._torso_offsets = arrays.arm_base_p - arrays.arm_base_p[0]
        self._margin = max(arrays.margin, arrays.self_margin)
        self._starts = start_limits(arrays.chain.lower, arrays.chain.upper)
        self._solver = SnoptSolver()

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return the answer after each number of TRIES; the first that succeeds is the last."""
        x, y, yaw = pair.base
        X_WB = RigidTransform(RotationMatrix.MakeZRotation(yaw), [x, y, 0.0])
        self._parts.base.SetPoseInParentFrame(self._context, X_WB)
        X_BT = RigidTransform(self._torso_offsets[pair.torso_level])
        self._parts.torso.SetPoseInParentFrame(self._context, X_BT)
        begun = time.process_time()
        ik = InverseKinematics(self._plant, self._context, with_joint_limits=True)
        world, p = self._plant.world_frame(), pair.X_WG.translation()
        ik.AddPositionConstraint(
            self._parts.tool, np.zeros(3), world, p - INSIDE_POSITION, p + INSIDE_POSITION
        )
        ik.AddOrientationConstraint(
            world, pair.X_WG.rotation(), self._parts.tool, RotationMatrix(), INSIDE_ROTATION
        )
        if self._distance:
            ik.AddMinimumDistanceLowerBoundConstraint(self._margin, INFLUENCE)
        answers: list[Answer] = []
        for n in range(1, TRIES[-1] + 1):
            result = self._solver.Solve(ik.prog(), rng.uniform(*self._starts))
            found = (result.GetSolution(ik.q()),) if result.is_success() else ()
            answer = Answer(time.process_time() - begun, found)
            if n in TRIES:
                answers.append(answer)
            if found:
                break
        return tries_filled(answers, answer, len(TRIES))


@dataclass(frozen=True)
class Floor:
    """What it costs Drake to check every winner just once."""

    seconds: float
    """By the clock."""
    processor_seconds: float
    contexts: int
    """How many contexts the checker has: one for each thread, or they wait for each other."""
    colliding: int
    """Winners it finds in collision; none, unless arrays and plant differ."""


class WinnersChecker:
    """Drake's SceneGraphCollisionChecker on winning postures."""

    def __init__(self, lowered: LoweredScene) -> None:
        """Build plant and checker."""
        builder = RobotDiagramBuilder(time_step=0.0)
        parts = add_arm(builder.plant(), builder.scene_graph(), lowered, joints=True)
        arrays = lowered.arrays
        self._heights = np.linalg.norm(arrays.arm_base_p - arrays.arm_base_p[0], axis=1)
        self._checker = SceneGraphCollisionChecker(
            model=builder.Build(),
            robot_model_instances=[parts.robot],
            # Used only for paths, which are not checked here.
            edge_step_size=0.1,
            # Overlaps only, the cheapest query.
            env_collision_padding=0.0,
            self_collision_padding=0.0,
            # The default follows OMP_NUM_THREADS, and OMP_NUM_THREADS=1 would give one context.
            implicit_context_parallelism=Parallelism(THREADS),
        )

    def configurations(self, base: FloatArray, level: FloatArray, arm: FloatArray) -> FloatArray:
        """Return the checker's configurations.

        Args:
            base: x, y [m] and yaw [rad], shape (n, 3).
            level: Torso levels, shape (n,).
            arm: Joint angles [rad], shape (n, 7).

        Returns:
            Shape (n, 11).
        """
        plant = self._checker.plant()
        values = np.hstack([base, self._heights[level][:, None], arm])
        names = (*BASE, "torso", *(f"arm_{i + 1}" for i in range(7)))
        columns = [plant.GetJointByName(name).position_start() for name in names]
        q = np.empty_like(values)
        q[:, columns] = values
        return q

    def check(self, configurations: FloatArray) -> Floor:
        """Check every configuration once, on two threads."""
        rows = list(configurations)
        begun, used = time.perf_counter(), time.process_time()
        free = self._checker.CheckConfigsCollisionFree(rows, Parallelism(THREADS))
        return Floor(
            seconds=time.perf_counter() - begun,
            processor_seconds=time.process_time() - used,
            contexts=self._checker.num_allocated_contexts(),
            colliding=len(free) - sum(free),
        )

    def overlaps(self, configurations: FloatArray) -> tuple[float, int]:
        """Query the scene graph for overlaps only, one by one on one thread.

        Returns:
            Processor time [s], and how many do.
        """
        model, plant = self._checker.model(), self._checker.plant()
        root = model.CreateDefaultContext()
        context = plant.GetMyMutableContextFromRoot(root)
        port, count = plant.get_geometry_query_input_port(), 0
        begun = time.process_time()
        for q in configurations:
            plant.SetPositions(context, q)
            count += port.Eval(context).HasCollisions()
        return time.process_time() - begun, count


def torso_axis(arm_base_p: FloatArray) -> FloatArray:
    """Return the direction in which the torso lifts the arm base, upward if it does not."""
    rise = arm_base_p[-1] - arm_base_p[0]
    length = float(np.linalg.norm(rise))
    return rise / length if length > 0.0 else np.eye(3)[2]


def _register(
    plant: MultibodyPlant, shapes: Shapes, body: Callable[[int], RigidBody], name: str
) -> list[GeometryId]:
    """Give the bodies their shapes, as they are in the first state."""
    return [
        plant.RegisterCollisionGeometry(
            body(k),
            _pose(shapes.R[0, k], shapes.p[0, k]),
            _shape(int(shapes.type[k]), shapes.size[k]),
            f"{name} {k}",
            ProximityProperties(),
        )
        for k in range(len(shapes.type))
    ]


def _shape(shape_type: int, size: FloatArray) -> Shape:
    if shape_type == BOX:
        return Box(*(2.0 * size))
    return Capsule(size[0], 2.0 * size[1]) if shape_type == CAPSULE else Sphere(size[0])


def _allow(
    declaration: CollisionFilterDeclaration, shape: GeometryId, partners: list[GeometryId]
) -> None:
    if partners:
        declaration.AllowBetween(GeometrySet([shape]), GeometrySet(partners))


def _pose(R: FloatArray, p: FloatArray) -> RigidTransform:
    return RigidTransform(RotationMatrix(R), p)
