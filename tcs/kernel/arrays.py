"""Arrays that describe a scene, its goals and its grid: the input of the kernel.

Frames (letters as in Drake): W environment, B robot base, A arm base (the link
that carries joint 1 of the arm, at the current torso level), L1..L7 the arm's
links, T the tool, G a goal. Link frames are chosen so that joint i rotates about
the z axis of `Li` and `X_AL1..7` follow from `Chain` alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

SPHERE, CAPSULE, BOX = 0, 1, 2
"""Shape types. `size` holds: sphere (radius, 0, 0); capsule along its own z
(radius, half length between cap centres, 0); box (three half sizes)."""


class Chain(NamedTuple):
    """A serial arm of five to seven joints, each about or along the z axis of its own link frame.

    X_AL1 = F[0] Rz(q1), X_ALi = X_AL(i-1) F[i-1] Rz(qi), X_AT = X_AL7 F[7], with a translation by
    `slides` times qi along z in place of Rz(qi) for a prismatic joint.

    An arm of six joints has a further joint before its first one, about the same axis, which has no
    limits and remains at 0: its own joints are q2 to q7. One of five has two such joints.
    """

    R: FloatArray
    """Rotations of F, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of F [m], shape (8, 3)."""
    lower: FloatArray
    """Lower joint limits [rad], shape (7,); -inf where continuous."""
    upper: FloatArray
    """Upper joint limits [rad], shape (7,); +inf where continuous."""
    joints: int = 7
    """Number of joints of the arm, 5 to 7."""
    slides: FloatArray = np.zeros(7)
    """Motion of each prismatic joint per unit [m/m], 0 for a revolute joint, shape (7,). Coupled
    joints count as one, whose motion is the sum of theirs."""
    coupled: FloatArray = np.empty((0, 2))
    """Links between coupled joints: index of their joint, and the fraction of its motion that the
    link makes, shape (n, 2). Their frames, numbered from 8 on, are parallel to that of the joint's
    link, and at the same place with the joint at 0."""


class Shapes(NamedTuple):
    """Collision shapes, posed in one or several states (torso levels or environment states)."""

    type: NDArray[np.int8]
    """SPHERE, CAPSULE or BOX, shape (n,)."""
    size: FloatArray
    """Sizes [m], shape (n, 3)."""
    pad: FloatArray
    """Greatest distance by which the true surface may exceed the shape [m], shape (n,)."""
    body: NDArray[np.int16]
    """Index of the body of each shape, in the lowered scene's list of names, shape (n,)."""
    frame: NDArray[np.int8]
    """Parent of each shape, shape (n,). Arm shapes: number of the link, 1..7. Body shapes: 0 fixed
    to the base, 1 mounted on the torso. Environment shapes: 0."""
    R: FloatArray
    """Orientations, shape (states, n, 3, 3)."""
    p: FloatArray
    """Centres [m], shape (states, n, 3)."""


class BodyDistances(NamedTuple):
    """Tables of lower bounds of the distance of two bodies of the robot.

    The cells of a table divide a full turn of two joints, from 0 on. The distance decreases by at
    most the reach of a joint times its motion.
    """

    body: IntArray
    """Indices of the two bodies in the lowered scene's list of names, shape (n, 2)."""
    joint: IntArray
    """Indices of the two joints in the chain, 0 .. 6, shape (n, 2)."""
    size: IntArray
    """Number of cells of a full turn of either joint, shape (n, 2)."""
    reach: FloatArray
    """Reach of either joint [m/rad], shape (n, 2)."""
    corners: NDArray[np.uint8]
    """Distances at the corners of the cells, in steps of 0.04 mm, rounded down; row by row, table
    by table."""


NO_DISTANCES = BodyDistances(
    np.empty((0, 2), np.int64),
    np.empty((0, 2), np.int64),
    np.empty((0, 2), np.int64),
    np.empty((0, 2)),
    np.empty(0, np.uint8),
)


def goals_of(first_pose: IntArray, goal_p: FloatArray) -> int:
    """Return the number of goals, from `first_pose` and `goal_p` of a scene or a problem."""
    return len(first_pose) - 1 if len(first_pose) else goal_p.shape[1]


def poses_of(first_pose: IntArray, goal: int) -> range:
    """Return the numbers of the poses of a goal, from `first_pose` of a scene or a problem."""
    if not len(first_pose):
        return range(goal, goal + 1)
    return range(int(first_pose[goal]), int(first_pose[goal + 1]))


class SceneArrays(NamedTuple):
    """Everything needed to score any initial configuration of one scene against its goals.

    Shapes i and j collide when they come closer than `max(margin, pad_i + pad_j)`; two shapes of
    the robot, `max(self_margin, pad_i + pad_j)`, unless a table of distances shows that their
    bodies keep that distance.
    """

    chain: Chain
    arm_base_R: FloatArray
    """Orientation of A in B for each torso level, shape (torso levels, 3, 3)."""
    arm_base_p: FloatArray
    """Origin of A in B for each torso level [m], shape (torso levels, 3)."""
    arm: Shapes
    """Shapes of the moving links, one state: poses in link frames. Frame 7 is the gripper."""
    body: Shapes
    """All other shapes of the robot: poses in B, one state for each torso level."""
    environment: Shapes
    """Furniture, person, obstacles: poses in W, one state for each environment state."""
    arm_vs_arm: BoolArray
    """Whether each pair is checked, shape (n_arm, n_arm); symmetric, diagonal False."""
    arm_vs_body: BoolArray
    """Whether each pair is checked, shape (n_arm, n_body)."""
    arm_vs_environment: BoolArray
    """Whether each pair is checked, shape (n_arm, n_environment)."""
    body_vs_environment: BoolArray
    """Whether each pair is checked, shape (n_body, n_environment)."""
    margin: float
    """Least clearance [m] between a shape of the robot and one of the environment."""
    self_margin: float
    """Least clearance [m] between two shapes of the robot."""
    goal_R: FloatArray
    """Orientations of the goals' poses in W, shape (environment states, poses, 3, 3)."""
    goal_p: FloatArray
    """Positions of the goals' poses in W [m], shape (environment states, poses, 3)."""
    freedom: FloatArray = np.empty((0, 9))
    """What is free about each pose, in the columns of `tcs.kernel.freedom.forms`, shape
    (poses, 9); no rows if nothing is free."""
    first_pose: IntArray = np.empty(0, np.int64)
    """First pose of each goal, which any of its poses reaches, and their number, shape
    (goals + 1,); empty if each goal is one pose."""
    distances: BodyDistances = NO_DISTANCES
    """Tables of distances of bodies of the robot."""
    rest: FloatArray = np.empty((0, 7))
    """Rest postures of the arm [rad], in the order in which they are tried, shape (n, 7). Where the
    arm touches the environment in all of them, so does the robot's body; without one, it is not
    checked."""

    @property
    def goals(self) -> int:
        """Number of goals."""
        return goals_of(self.first_pose, self.goal_p)

    def poses_of(self, goal: int) -> range:
        """Return the numbers of the poses of a goal."""
        return poses_of(self.first_pose, goal)

    def is_single_pose(self, goal: int) -> bool:
        """Return whether a goal is one pose, about which nothing is free."""
        poses = list(self.poses_of(goal))
        return len(poses) == 1 and not (len(self.freedom) and np.any(self.freedom[poses[0]]))


class GridArrays(NamedTuple):
    """The discretised initial configurations, eta in the TCS paper.

    Flat order is C order over (environment state, base x, base y, base yaw, torso level).
    """

    environment_states: int
    """Number of environment states."""
    base_x: FloatArray
    """Values of base x in W [m], shape (nx,)."""
    base_y: FloatArray
    """Values of base y in W [m], shape (ny,)."""
    base_yaw: FloatArray
    """Values of base yaw [rad], shape (nyaw,)."""
    torso_levels: int
    """Number of torso levels."""

    @property
    def shape(self) -> tuple[int, int, int, int, int]:
        """Number of values along each axis, in the flat order."""
        base = (self.base_x.size, self.base_y.size, self.base_yaw.size)
        return (self.environment_states, *base, self.torso_levels)

    @property
    def size(self) -> int:
        """Number of configurations."""
        return math.prod(self.shape)
