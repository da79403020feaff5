"""Scene arrays arranged for speed, as compiled code reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.analytic.solver import ArmSolver, any_solver
from tcs.kernel.arrays import (
    BoolArray,
    Chain,
    FloatArray,
    IntArray,
    SceneArrays,
    Shapes,
    goals_of,
    poses_of,
)
from tcs.kernel.collide import BOUND, CENTRE, pack
from tcs.kernel.dexterity import DEFAULT_MEASURE, Dexterity, dexterity
from tcs.kernel.distances import DistanceTables, arranged
from tcs.kernel.freedom.forms import FEWEST_JOINTS
from tcs.kernel.freedom.goals import (
    FreeGoals,
    axis_left_free,
    free_goals,
    free_turn,
    no_freedom,
)
from tcs.kernel.resting import resting_arm
from tcs.kernel.shape_groups import ShapeGroups, groups_of, with_boxes, with_group_rows

UNCHECKED = -1.0
"""Gap of a pair of shapes that is not checked."""
TOUCH = 1e-9
"""Least gap of a pair that is checked [m], negligible against any clearance that matters."""


class Links(NamedTuple):
    """The chain of the arm, see `Chain`."""

    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], shape (8, 3); with a fourth column, `Chain.slides`, if there
    are prismatic joints."""
    coupled: FloatArray
    """As in `Chain`."""
    joints: int
    """Number of joints of the arm, as in `Chain`."""


class Frames(NamedTuple):
    """The arm base A in the robot's base B, for each torso level."""

    R: FloatArray
    """Orientations, shape (torso levels, 3, 3)."""
    p: FloatArray
    """Origins [m], shape (torso levels, 3)."""


class ArmShapes(NamedTuple):
    """The arm's shapes, packed, nearest to the tool first, then the boxes around their groups."""

    shapes: FloatArray
    """The shapes and boxes in link frames, shape (arm rows, 17)."""
    frame: IntArray
    """Link of each row in `shapes`, 7 .. 1 or the number of a coupled link's frame, shape
    (arm rows,)."""
    body: IntArray
    """Robot body of each shape without the boxes, shape (n_arm,)."""
    groups: ShapeGroups
    """Groups of the shapes."""
    gripper_groups: int
    """Number of groups of the gripper, on link 7: the first ones."""


class BodyShapes(NamedTuple):
    """Shapes of the rest of the robot, packed, then the boxes around their groups."""

    shapes: FloatArray
    """The shapes and boxes in B, shape (torso levels, body rows, 17)."""
    shapes_A: FloatArray
    """The same in A."""
    groups: ShapeGroups
    """Groups of the shapes."""
    spheres: FloatArray
    """Centre and radius of the bounding spheres of the body shapes fixed to the base (0) and
    mounted on the torso (1), in B [m], shape (torso levels, 2, 4)."""
    mount: IntArray
    """BASE_FIXED or TORSO_MOUNTED for each shape without the boxes, shape (n_body,)."""
    body: IntArray
    """Robot body of each shape without the boxes, shape (n_body,)."""


class RestShapes(NamedTuple):
    """The arm in its rest postures."""

    shapes: FloatArray
    """The rows of the arm's shapes in B in each rest posture, shape
    (torso levels, postures, arm rows, 17)."""
    spheres: FloatArray
    """The bounding sphere of each, as a packed shape in B, shape (torso levels, postures, 17)."""


class Environment(NamedTuple):
    """Furniture and person."""

    shapes: FloatArray
    """Shapes in W, packed, shape (environment states, n_environment, 17)."""
    body: IntArray
    """Environment body of each shape, shape (n_environment,)."""
    bodies: int
    """Number of bodies of the environment."""


class Clearances(NamedTuple):
    """Distances [m] that pairs of shapes must keep, or UNCHECKED."""

    environment: FloatArray
    """Of arm and environment shapes, shape (arm rows, n_environment)."""
    body: FloatArray
    """Of arm and body shapes, shape (arm rows, body rows)."""
    arm: FloatArray
    """Of arm shapes among themselves, shape (arm rows, arm rows)."""
    base: FloatArray
    """Of body and environment shapes, shape (body rows, n_environment)."""
    widest: float
    """Upper bound of all these distances [m]."""
    arm_radius: float
    """Distance from the origin of A beyond which nothing touches the arm [m]."""


class Goals(NamedTuple):
    """Poses of the tool, and what is free about them."""

    R: FloatArray
    """Orientations of the goals' poses in W, shape (environment states, poses, 3, 3)."""
    p: FloatArray
    """Positions of the goals' poses in W [m], shape (environment states, poses, 3)."""
    first_pose: IntArray
    """First pose of each goal, which any of its poses reaches, and their number, shape
    (goals + 1,); empty if each goal is one pose."""
    freedom: FreeGoals
    """What is free about the poses, which are nominal ones."""
    turn: FloatArray
    """Unit axis in T about which all goals leave the tool free to rotate, if an arm of five joints
    depends on it, else zeros, shape (3,)."""

    @property
    def number(self) -> int:
        """Number of goals."""
        return goals_of(self.first_pose, self.p)

    def poses_of(self, goal: int) -> range:
        """Return the numbers of the poses of a goal."""
        return poses_of(self.first_pose, goal)

    def at(self, R: FloatArray, p: FloatArray) -> Goals:
        """Return as many goals, or of single poses any number, at other poses in W."""
        return self._replace(R=_own(R), p=_own(p))


class Problem(NamedTuple):
    """One scene and its goals, in some environment states and at some torso levels.

    The robot's shapes are grouped by body: the rows of shapes are followed by those of
    `ShapeGroups`. The clearance of a box is the greatest of its shapes.
    """

    measure: Dexterity
    """Dexterity measure to maximise."""
    arm: ArmSolver
    """Constants of the closed form, which may describe the reversed chain; without branches if
    there is none (`is_outside`), or the arm has six joints, which `six_joints` solves. The other
    fields describe the arm itself."""
    chain: Links
    arm_base: Frames
    links: ArmShapes
    body: BodyShapes
    rest: RestShapes
    robot_bodies: int
    """Number of bodies of the robot."""
    environment: Environment
    clearances: Clearances
    distances: DistanceTables
    """Tables of distances of bodies of the robot."""
    goals: Goals

    def at_poses(self, R: FloatArray, p: FloatArray) -> Problem:
        """Return the problem with its goals at other poses in W, see `Goals.at`."""
        return self._replace(goals=self.goals.at(R, p))

    def at_single_poses(self, R: FloatArray, p: FloatArray) -> Problem:
        """Return the problem with goals of single poses in W, any number of them, see `Goals.at`.

        An arm of five joints may rotate the tool about its free axis at each.
        """
        freedom = no_freedom()
        if self.chain.joints == FEWEST_JOINTS:
            freedom = free_turn(self.goals.turn, p.shape[1], self.goals.freedom.reach)
        single = self.goals._replace(first_pose=np.empty(0, np.int64), freedom=freedom)
        return self._replace(goals=single.at(R, p))


def build_problem(scene: SceneArrays, measure: str = DEFAULT_MEASURE) -> Problem:
    """Return `scene` arranged for the kernel.

    Args:
        scene: The scene and its goals.
        measure: Name of the dexterity measure to maximise.

    Raises:
        UnknownNameError: If there is no measure of that name.
    """
    order = arm_order(scene)
    R_AB = np.swapaxes(scene.arm_base_R, 1, 2)
    from_arm_base = scene.body.p - scene.arm_base_p[:, None]
    body_A = scene.body._replace(
        R=R_AB[:, None] @ scene.body.R, p=np.einsum("tij,tnj->tni", R_AB, from_arm_base)
    )
    frame = scene.arm.frame[order].astype(np.int64)
    pads = scene.arm.pad[order], scene.body.pad, scene.environment.pad
    margin, self_margin = scene.margin, scene.self_margin
    widest = max(margin, self_margin, 2.0 * max(float(pad.max(initial=0.0)) for pad in pads))
    links, link_body = pack(scene.arm, order), scene.arm.body[order].astype(np.int64)
    mount, body_body = scene.body.frame.astype(np.int64), scene.body.body.astype(np.int64)
    link_groups = groups_of(scene.arm.p[0, order], frame, link_body)
    body_groups = groups_of(scene.body.p[0], mount, body_body)
    in_boxes = np.array([inside[0] for inside in link_groups.in_boxes()], np.int64)
    packed = pack(scene.body)
    bodies = with_boxes(np.concatenate([packed, pack(body_A)]), body_groups)
    robot_bodies = max(_count(scene.arm), _count(scene.body))
    return Problem(
        measure=dexterity(measure),
        arm=any_solver(scene.chain),
        chain=Links(
            R=_own(scene.chain.R),
            p=with_slides(scene.chain),
            coupled=_own(scene.chain.coupled),
            joints=scene.chain.joints,
        ),
        arm_base=Frames(_own(scene.arm_base_R), _own(scene.arm_base_p)),
        links=ArmShapes(
            shapes=with_boxes(links, link_groups)[0],
            frame=np.append(frame, frame[in_boxes]),
            body=link_body,
            groups=link_groups,
            gripper_groups=int(np.sum(frame[link_groups.first[:-1]] == 7)),
        ),
        body=BodyShapes(
            shapes=_own(bodies[: len(packed)]),
            shapes_A=_own(bodies[len(packed) :]),
            groups=body_groups,
            spheres=_bounding_spheres(packed, scene.body.frame),
            mount=mount,
            body=body_body,
        ),
        rest=RestShapes(*resting_arm(scene, order, link_groups)),
        robot_bodies=robot_bodies,
        environment=Environment(
            shapes=pack(scene.environment),
            body=scene.environment.body.astype(np.int64),
            bodies=_count(scene.environment),
        ),
        clearances=Clearances(
            environment=with_group_rows(
                _gaps(scene.arm_vs_environment[order], pads[0], pads[2], margin), link_groups
            ),
            body=_with_groups(
                _gaps(scene.arm_vs_body[order], pads[0], pads[1], self_margin),
                link_groups,
                body_groups,
            ),
            arm=_with_groups(
                _gaps(scene.arm_vs_arm[order][:, order], pads[0], pads[0], self_margin),
                link_groups,
                link_groups,
            ),
            base=with_group_rows(
                _gaps(scene.body_vs_environment, pads[1], pads[2], margin), body_groups
            ),
            widest=widest,
            arm_radius=_arm_radius(scene.chain, links[0], frame) + widest,
        ),
        distances=arranged(scene.distances, robot_bodies),
        goals=Goals(
            R=_own(scene.goal_R),
            p=_own(scene.goal_p),
            first_pose=np.array(scene.first_pose, dtype=np.int64),
            freedom=free_goals(scene.freedom, scene.chain, dexterity(measure)),
            turn=axis_left_free(scene.freedom, scene.chain),
        ),
    )


def chain_of(problem: Problem) -> Chain:
    """Return the chain of a problem's arm."""
    R, p, _, joints = problem.chain
    slides = p[:7, 3].copy() if p.shape[1] > 3 else np.zeros(7)
    return Chain(R, p[:, :3].copy(), problem.arm.lower, problem.arm.upper, joints, slides)


def with_environment(problem: Problem, scene: SceneArrays) -> Problem:
    """Return a problem with its environment in other states, without arranging the robot again.

    Args:
        problem: A problem of the same scene.
        scene: The scene with these states of its environment.
    """
    environment = problem.environment._replace(shapes=pack(scene.environment))
    return problem.at_poses(scene.goal_R, scene.goal_p)._replace(environment=environment)


def gaps_between(
    first: SceneArrays, second: SceneArrays, groups: ShapeGroups, other_groups: ShapeGroups
) -> FloatArray:
    """Return the distances that the shapes of two arms of one robot must keep [m].

    Every pair is checked: what one robot file exempts holds for a parked second arm only.

    Args:
        first: The scene of one arm.
        second: The scene of the other.
        groups: `links.groups` of the problem of the first.
        other_groups: `links.groups` of the problem of the second.

    Returns:
        Rows and columns in the order of the problems, with those of the boxes at the end.
    """
    pad, other = (scene.arm.pad[arm_order(scene)] for scene in (first, second))
    checked = np.ones((len(pad), len(other)), np.bool_)
    margin = max(first.self_margin, second.self_margin)
    return _with_groups(_gaps(checked, pad, other, margin), groups, other_groups)


def with_slides(chain: Chain) -> FloatArray:
    """Return the translations of a chain, with a column for its prismatic joints if it has any."""
    if not np.any(chain.slides):
        return _own(chain.p)
    return _own(np.column_stack([chain.p, np.append(chain.slides, 0.0)]))


def travel(chain: Chain) -> FloatArray:
    """Return how far each prismatic joint moves from 0 [m], 0 for a revolute joint, shape (7,)."""
    slides = chain.slides > 0.0
    farthest = np.maximum(np.abs(chain.lower), np.abs(chain.upper))
    return np.where(slides, np.where(slides, farthest, 0.0) * chain.slides, 0.0)


def arm_order(scene: SceneArrays) -> IntArray:
    """Return the order of the arm's shapes in a problem: nearest to the tool first.

    Coupled links have their place between those beside them.
    """
    rank = np.arange(8.0 + len(scene.chain.coupled))
    rank[8:] = scene.chain.coupled[:, 0] + 0.5
    order: IntArray = np.argsort(-rank[scene.arm.frame.astype(np.int64)], kind="stable")
    return order


def _arm_radius(chain: Chain, links: FloatArray, frame: IntArray) -> float:
    """Return an upper bound of the distance of the arm's shapes from the origin of A [m]."""
    steps = np.linalg.norm(chain.p[:7], axis=1) + travel(chain)
    reach = np.concatenate([[0.0], np.cumsum(steps)])
    reach = np.append(reach, reach[chain.coupled[:, 0].astype(np.int64) + 1])
    out = np.linalg.norm(links[:, CENTRE : CENTRE + 3], axis=1) + links[:, BOUND]
    return float(np.max(reach[frame] + out, initial=0.0))


def _bounding_spheres(bodies: FloatArray, mount: NDArray[np.int8]) -> FloatArray:
    """Return the bounding sphere of each of the two mounts; radius -inf if it has no shapes."""
    spheres = np.full((len(bodies), 2, 4), -np.inf)
    spheres[..., :3] = 0.0
    for group in (0, 1):
        rows = bodies[:, mount == group]
        if not rows.shape[1]:
            continue
        centres, radii = rows[..., CENTRE : CENTRE + 3], rows[..., BOUND, None]
        low, high = (centres - radii).min(axis=1), (centres + radii).max(axis=1)
        middle = (low + high) / 2
        out = np.linalg.norm(centres - middle[:, None], axis=2) + rows[..., BOUND]
        spheres[:, group, :3], spheres[:, group, 3] = middle, out.max(axis=1)
    return spheres


def _count(shapes: Shapes) -> int:
    """Return the number of bodies that the shapes belong to: the highest index plus one."""
    return int(shapes.body.max(initial=-1)) + 1


def _own(array: FloatArray) -> FloatArray:
    """Return a writable copy: numba compiles anew for read-only arrays, which are another type."""
    return np.array(array, dtype=np.float64, order="C")


def _with_groups(gaps: FloatArray, groups: ShapeGroups, others: ShapeGroups) -> FloatArray:
    """Return gaps of two sets of shapes with those of their groups in further rows and columns."""
    whole = with_group_rows(with_group_rows(gaps, groups).T, others).T
    return np.ascontiguousarray(whole)


def _gaps(checked: BoolArray, pad_a: FloatArray, pad_b: FloatArray, margin: float) -> FloatArray:
    """Return the distance that each pair must keep [m], or UNCHECKED."""
    required = np.maximum(margin, pad_a[:, None] + pad_b[None, :])
    # The loops skip pairs whose gap is not above 0; shapes that touch must collide all the same.
    required = np.maximum(required, TOUCH)
    return np.ascontiguousarray(np.where(checked, required, UNCHECKED))
