"""A live scene: a robot in an environment as a Drake plant with one state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydrake.geometry import QueryObject
from pydrake.math import RigidTransform
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.framework import Context

from tcs.errors import TcsError, UnknownNameError
from tcs.kernel.arrays import FloatArray
from tcs.model.grid import Grid
from tcs.model.scene.attached import AttachedPoses
from tcs.model.scene.contacts import Group, Part
from tcs.model.scene.plant import ScenePlant, build_plant
from tcs.model.scene.spec import SceneSpec
from tcs.model.scene.surfaces import SurfaceContacts

Contact = tuple[str, str, float]
"""Two bodies and the signed distance between them [m]."""


class Scene:
    """One robot in one environment, as a Drake plant with one state.

    Initially the base is at the origin, the torso at its lower limit, the arm at zero and the
    environment in the state of its file. Drake plants cannot be pickled: pass the spec to other
    processes, and build a scene from it there.
    """

    def __init__(
        self,
        spec: SceneSpec,
        *,
        allowed_contacts: Iterable[tuple[str, str]] = (),
        meshes: bool = False,
    ) -> None:
        """Build the plant.

        Args:
            spec: Robot and environment.
            allowed_contacts: Pairs (robot body, environment body) that may touch.
            meshes: Whether to load the robot's visual meshes, which takes seconds; only drawing
                needs them.

        Raises:
            RobotError: If the robot's model cannot be used.
            EnvironmentFileError: If a model of the environment cannot be used, or a joint cannot
                take its position.
            GridError: If an observed axis does not fit its joint.
            UnknownNameError: If a file names something that does not exist.
        """
        self.spec = spec
        self.built: ScenePlant = build_plant(spec, tuple(allowed_contacts), meshes=meshes)
        self.context: Context = self.built.diagram.CreateDefaultContext()
        self._state = self.built.plant.GetMyMutableContextFromRoot(self.context)
        joints = self.built.arm_joints
        self._arm_positions = np.array([joint.position_start() for joint in joints])
        self._arm_velocities = np.array([joint.velocity_start() for joint in joints])
        self._followers = [
            (i, joint.position_start(), joint.velocity_start())
            for i, followers in enumerate(self.built.coupled_joints)
            for joint in followers
        ]
        self._attached: dict[Group, AttachedPoses] = {}
        self._pads: dict[str, float] = {}
        self._of_environment: set[str] = set()
        self._part_of = {part.geometry: part for part in self.built.parts}
        self._self_margin = spec.robot.self_margin
        self._contact_margin = spec.environment.contact_margin
        self._surfaces = SurfaceContacts(spec.robot, self.built.parts, self.built.arm_joints)
        for part in self.built.parts:
            # The shapes of one link share its padding.
            self._pads[part.name] = max(part.pad, self._pads.get(part.name, 0.0))
            if part.group is Group.ENVIRONMENT:
                self._of_environment.add(part.name)
        self.set_torso(0.0)

    @property
    def plant_context(self) -> Context:
        """Context of the plant within `context`."""
        return self._state

    @property
    def arm_limits(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limits of the arm [rad], infinite where continuous."""
        return self.built.arm_lower, self.built.arm_upper

    def attached(self, group: Group) -> AttachedPoses:
        """Return the poses of the shapes of a group in their bodies, in the order of the parts."""
        if group not in self._attached:
            parts = [part for part in self.built.parts if part.group is group]
            inspector = self.built.scene_graph.model_inspector()
            self._attached[group] = AttachedPoses.of_parts(self.built.plant, inspector, parts)
        return self._attached[group]

    def place_base(self, x: float, y: float, yaw: float) -> None:
        """Place the robot's base B at (x, y) in M [m] with heading `yaw` [rad].

        M is W, or the frame of the environment's mount.
        """
        for joint, value in zip(self.built.base_joints, (x, y, yaw), strict=True):
            self._set(joint.position_start(), value)

    def set_torso(self, height: float) -> float:
        """Set the torso to a height, clipped to its limits, and return the height set [m].

        For a robot without a torso joint, return 0.
        """
        joint = self.built.torso_joint
        if joint is None:
            return 0.0
        used = float(np.clip(height, *self.built.torso_limits))
        self._set(joint.position_start(), used)
        return used

    def set_arm(self, positions: ArrayLike) -> None:
        """Set the joints of the scored arm [rad or m] and those coupled to them, in its order.

        Limits are not enforced. Seven numbers for an arm of six joints are those of the kernel's
        chain, whose first joint remains at 0.

        Raises:
            TcsError: If there are not exactly as many finite numbers as joints.
        """
        values = np.asarray(positions, dtype=float)
        if values.shape == (7,) and values[0] == 0.0:
            values = values[-len(self._arm_positions) :]
        if values.shape != self._arm_positions.shape or not np.all(np.isfinite(values)):
            raise TcsError(
                f"arm positions must be {len(self._arm_positions)} finite numbers [rad], "
                f"but are {positions!r}."
            )
        q = self.built.plant.GetPositions(self._state).copy()
        q[self._arm_positions] = values
        for i, position, _ in self._followers:
            q[position] = values[i]
        self.built.plant.SetPositions(self._state, q)

    def set_robot_joints(self, names: Sequence[str], positions: ArrayLike) -> None:
        """Set joints of the robot other than those of the scored arm [rad or m].

        Args:
            names: Names of the joints.
            positions: Their positions; seven numbers for six joints as for `set_arm`.
        """
        values = np.asarray(positions, dtype=float)[-len(names) :]
        for name, value in zip(names, values, strict=True):
            joint = self.built.plant.GetJointByName(name)
            self._set(joint.position_start(), float(value))

    def set_joint(self, name: str, value: float) -> None:
        """Set a joint of the environment [m or rad], and the joints that follow it.

        Raises:
            UnknownNameError: If the environment has no such joint.
            TcsError: If the joint follows another one, or the value exceeds its limits.
        """
        where = f"environment '{self.spec.environment.name}'"
        for joint, position in self.built.environment_joints.positions(name, value, where=where):
            self._set(joint.position_start(), position)

    def positions(self) -> FloatArray:
        """Return the positions of all joints for `restore`, shape (n,)."""
        return np.array(self.built.plant.GetPositions(self._state))

    def positions_without_arm(self) -> FloatArray:
        """Return the positions of all joints but those of the scored arm, shape (n - 7,)."""
        return np.delete(self.positions(), self._arm_positions)

    def restore(self, positions: FloatArray) -> None:
        """Set all joints to positions that `positions` returned."""
        self.built.plant.SetPositions(self._state, positions)

    def tool_pose(self) -> RigidTransform:
        """Return X_WT, the pose of the tool in the environment frame."""
        return self.built.tool_frame.CalcPoseInWorld(self._state)

    def base_pose(self) -> RigidTransform:
        """Return X_WB, the pose of the robot's base in the environment frame."""
        return self.built.base_frame.CalcPoseInWorld(self._state)

    def mount_pose(self) -> RigidTransform:
        """Return X_WM of the frame in which base poses are given; the identity without a mount."""
        return self.built.mount_frame.CalcPoseInWorld(self._state)

    def seen_from_mount(self, poses: Iterable[RigidTransform]) -> list[RigidTransform]:
        """Return poses in W as poses in M; without a mount they are the same."""
        if self.spec.environment.mount is None:
            return list(poses)
        X_MW = self.mount_pose().inverse()
        return [X_MW @ X for X in poses]

    def body_frame_pose(self, name: str, *, where: str = "") -> RigidTransform:
        """Return X_WH, the pose of a body frame, e.g. "head".

        Args:
            name: One of the environment file's body frames.
            where: The source of the name, for the message.

        Raises:
            UnknownNameError: If the environment has no such body frame.
        """
        frames = self.built.body_frames
        if name not in frames:
            place = where or f"environment '{self.spec.environment.name}'"
            raise UnknownNameError("frame", name, frames, where=place)
        return frames[name].CalcPoseInWorld(self._state)

    def tool_jacobian(self) -> FloatArray:
        """Return the Jacobian of the tool's velocity V_WT with respect to the arm's joints.

        Returns:
            Shape (6, 7), rows angular then linear [rad/rad; m/rad], expressed in W.
        """
        plant = self.built.plant
        world = plant.world_frame()
        jacobian = plant.CalcJacobianSpatialVelocity(
            self._state,
            JacobianWrtVariable.kV,
            self.built.tool_frame,
            np.zeros(3),
            world,
            world,
        )
        columns = np.array(jacobian[:, self._arm_velocities])
        for i, _, velocity in self._followers:
            columns[:, i] += jacobian[:, velocity]
        return columns

    def shape_pose(self, part: Part) -> RigidTransform:
        """Return X_WG, the pose of a collision shape."""
        port = self.built.plant.get_geometry_query_input_port()
        return port.Eval(self._state).GetPoseInWorld(part.geometry)

    def query_object(self) -> QueryObject:
        """Return Drake's query object at the current state, valid until the scene is asked again.

        The first call takes longer than the others: Drake lists all pairs of shapes.
        """
        return self.built.contacts.at(self.positions())

    def clearances(self, max_distance: float) -> tuple[Contact, ...]:
        """Return the distances between checked pairs of bodies, closest first.

        Args:
            max_distance: Distance beyond which pairs are omitted [m].

        Returns:
            For each pair of bodies the least signed distance between their shapes, negative where
            they overlap. Bodies of the arm come first in a pair, those of the environment last.
            Where shapes are closer than required and a table of distances shows that the surfaces
            are not, it is the distance of the surfaces.
        """
        query = self.query_object()
        return self.by_surfaces(
            least_distances(
                (self._part_of[pair.id_A], self._part_of[pair.id_B], pair.distance)
                for pair in query.ComputeSignedDistancePairwiseClosestPoints(max_distance)
            )
        )

    def by_surfaces(self, contacts: Iterable[Contact]) -> tuple[Contact, ...]:
        """Return contacts with distances of surfaces where a table says that they decide.

        Args:
            contacts: Pairs of bodies with the distances of their shapes at the current state.
        """
        plant, found = self.built.plant, []
        for first, second, apart in contacts:
            required = self.required_clearance(first, second)
            distance = None
            if apart < required:
                distance = self._surfaces.distance(plant, self._state, first, second, required)
            found.append((first, second, apart if distance is None else distance))
        return tuple(sorted(found, key=lambda contact: (contact[2], contact[:2])))

    def required_clearance(self, first: str, second: str) -> float:
        """Return the distance that two bodies must keep [m].

        It is the robot's self margin if both are bodies of the robot, else the environment's
        contact margin; or the sum of the paddings of the two bodies if that is larger.

        Raises:
            UnknownNameError: If there is no collision shape of a name.
        """
        for name in (first, second):
            if name not in self._pads:
                raise UnknownNameError("body", name, self._pads)
        paddings = self._pads[first] + self._pads[second]
        is_self = self._of_environment.isdisjoint((first, second))
        margin = self._self_margin if is_self else self._contact_margin
        return max(margin, paddings)

    def violations(self) -> tuple[Contact, ...]:
        """Return the checked pairs of bodies that are closer than required, closest first."""
        return tuple(
            contact
            for contact in self.clearances(self._greatest_requirement())
            if contact[2] < self.required_clearance(contact[0], contact[1])
        )

    def of_environment(self, contacts: Iterable[Contact]) -> tuple[Contact, ...]:
        """Return those of some contacts that are with the environment."""
        return tuple(contact for contact in contacts if contact[1] in self._of_environment)

    def resting_arm(self) -> FloatArray:
        """Return the posture in which the arm rests at the present state [rad]; it stays as it is.

        It is the first rest posture of the robot file that is free of the environment, or the first
        one where none is.
        """
        postures = [np.array(q) for q in self.spec.robot.rest_postures().values()]
        before = self.positions()
        for q in postures[: len(postures) if len(postures) > 1 else 0]:
            self.set_arm(q)
            touches = self.of_environment(self.violations())
            self.restore(before)
            if not touches:
                return q
        return postures[0]

    def _greatest_requirement(self) -> float:
        """Return the greatest distance that any checked pair of bodies must keep [m]."""
        of_robot = sorted(p for name, p in self._pads.items() if name not in self._of_environment)
        others = max((self._pads[name] for name in self._of_environment), default=0.0)
        own = sum(of_robot[-2:])
        return max(self._self_margin, self._contact_margin, own, of_robot[-1] + others)

    def _set(self, index: int, value: float) -> None:
        q = self.built.plant.GetPositions(self._state).copy()
        q[index] = value
        self.built.plant.SetPositions(self._state, q)


def least_distances(pairs: Iterable[tuple[Part, Part, float]]) -> tuple[Contact, ...]:
    """Return the least distance of each pair of bodies, closest first.

    Args:
        pairs: Two shapes and their signed distance [m].

    Returns:
        Bodies of the arm come first in a pair, those of the environment last.
    """
    order = (Group.ARM, Group.BODY, Group.ENVIRONMENT)
    least: dict[tuple[str, str], float] = {}
    for first, second, distance in pairs:
        both = sorted(
            (first, second), key=lambda part: (order.index(part.group), part.carrier, part.name)
        )
        names = (both[0].name, both[1].name)
        least[names] = min(distance, least.get(names, np.inf))
    found = [(a, b, float(distance)) for (a, b), distance in least.items()]
    return tuple(sorted(found, key=lambda contact: (contact[2], contact[:2])))


def body_frame_positions(scene: Scene, grid: Grid) -> dict[str, list[float]]:
    """Return the position of each body frame in M for each environment state of a grid.

    M is the frame of the base poses: W, or that of the environment's mount.

    Args:
        scene: The scene; its state is restored.
        grid: The grid, whose environment axes move the joints of the same name.

    Returns:
        By name of the body frame: x, y, z [m] of all states, concatenated in C order over the axes.
    """
    before = scene.positions()
    positions: dict[str, list[float]] = {name: [] for name in scene.built.body_frames}
    try:
        for state in grid.environment_states():
            for joint, value in state.items():
                scene.set_joint(joint, value)
            for name, numbers in positions.items():
                (X_MH,) = scene.seen_from_mount([scene.body_frame_pose(name)])
                numbers.extend(X_MH.translation().tolist())
    finally:
        scene.restore(before)
    return positions
