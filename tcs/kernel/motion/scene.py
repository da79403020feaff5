"""The arm, everything around it and the pairs to check, at one initial configuration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION
from tcs.kernel.distances import DistanceTables
from tcs.kernel.motion.link_poses import LANES
from tcs.kernel.problem import Problem, chain_of, travel
from tcs.kernel.rows import Rows

FULL_TURN = 2.0 * np.pi
STACK = 256
"""Capacity of a stack of pairs: two for each level of the trees of both shapes."""
MOST_PIECES = 16
"""Greatest number of pieces of a curve, a power of two."""
NO_PAIR = -1
GROUP = 16
"""Number of pairs that one vector loop checks."""
DEPTH = 40
"""Greatest number of halvings of a curve: 2^-40 of any motion is below RESOLUTION of `edges`."""
WIDE = 256
"""Greatest number of pieces of a curve that are certified level by level."""
LISTED = 8192
"""Greatest number of pairs that are listed for all of them: depth first, lists take less."""
FRAMES = 8
"""Number of the first link between coupled joints: those of the arm's joints are 1 .. 7."""
SEEN_FROM_TOOL = 4
"""First link whose motion is bounded by the joints between it and the tool too: no more joints are
on that side than on the other."""


class MotionChain(NamedTuple):
    """The chain of the arm, and how far its joints move points of it.

    There are always seven joints: the first ones, which an arm of fewer lacks, remain at 0.
    Positions of prismatic joints are in [m] where [rad] is written.
    """

    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], shape (8, 3); with a fourth column that holds `slides` if
    there are prismatic joints."""
    slides: FloatArray
    """Motion of each prismatic joint per unit [m/m], 0 for a revolute joint, shape (7,)."""
    coupled: FloatArray
    """Links between coupled joints, as in `Chain`, numbered from FRAMES on, shape (n, 2)."""
    reach: FloatArray
    """Bound on how far any point of the arm moves per unit of each joint: for a revolute one, how
    far it may be from the axis [m]; shape (7,)."""
    weight: FloatArray
    """Square of `reach` relative to its largest, shape (7,)."""
    aside: float
    """Bound on how far any point of the last links, from SEEN_FROM_TOOL on, may be from the origin
    of the first of them [m]."""
    free_axis: FloatArray
    """`Goals.turn`: the axis about which straight motions may rotate the tool of an arm of five
    joints, in T, else zeros, shape (3,)."""


class ChainLimits(NamedTuple):
    """Limits of the joints, 0 for one that remains at 0."""

    lower: FloatArray
    """Lower joint limits [rad], shape (7,); -inf where continuous."""
    upper: FloatArray
    """Upper joint limits [rad], shape (7,); +inf where continuous."""
    period: FloatArray
    """A full turn for each continuous joint, 0 for the others [rad], shape (7,)."""


class MotionShapes(NamedTuple):
    """Shapes and boxes around groups of them. Those of the arm are numbered first, then `fixed`."""

    links: FloatArray
    """The arm's shapes, packed, in link frames, shape (n_arm, 17)."""
    link_frame: IntArray
    """Link of each shape in `links`, 1 .. 7 or one between coupled joints, shape (n_arm,)."""
    fixed: FloatArray
    """Environment and rest of the robot, and boxes around groups of the latter, packed, in A, shape
    (n_fixed, 17)."""
    body: IntArray
    """Body of each shape, shape (n_arm + n_fixed,): index among the bodies of the environment, or
    that of a robot body plus the number of bodies of the environment."""
    robot: int
    """Number of the first body of the robot in `body`."""
    boxes: IntArray
    """Number of the arm's first box around others among its shapes, and of the first one around
    fixed shapes among all shapes, shape (2,)."""
    root: IntArray
    """Box around shapes of a link in which each shape of the arm is, itself if it is in none, shape
    (n_arm,)."""


class ShapePairs(NamedTuple):
    """The pairs of shapes that are checked: first those checked always, then those below others."""

    members: IntArray
    """Shape of the arm, other shape, and link that carries the other shape, 0 if it is fixed, of
    each pair; shape (n_pairs, 3). The other link is the one nearer to the base."""
    roots: IntArray
    """Shapes of the arm in the pairs that are checked always, or all, ascending."""
    first: IntArray
    """First pair of each shape of the arm, and the number of pairs of all, shape (n_arm + 1,).
    Pairs beyond these are below others."""
    first_moving: IntArray
    """First pair of each shape of the arm with another shape of the arm: pairs with fixed shapes
    come before those; shape (n_arm,)."""
    below: IntArray
    """First and one after the last of the pairs below each pair, equal if there are none; shape
    (n_pairs, 2), or (0, 2) without groups. They are apart if the pair is, see `box_trees`."""
    centre: FloatArray
    """Centre in A of the fixed shape of each pair that is checked always [m], shape
    (3, those pairs); 0 where both move."""
    bound: FloatArray
    """Sum of the radii of the bounding spheres of each pair [m], shape (n_pairs,)."""
    gap: FloatArray
    """Distance that each pair must keep [m], shape (n_pairs,)."""


class LeafSpheres(NamedTuple):
    """Bounding spheres of the shapes in boxes around those of a link, box by box."""

    spheres: FloatArray
    """Centre and radius of each, in the frame of the link [m], shape (4, n_leaf)."""
    span: IntArray
    """First and one after the last of the columns of `spheres` that are in each shape of the arm
    that is a box in no other box, equal for others, shape (n_arm, 2)."""
    shape: IntArray
    """Number of each of these shapes, shape (n_leaf,)."""
    pair: IntArray
    """Pair of each column of `spheres` with each fixed shape, NO_PAIR if it is not checked, shape
    (n_leaf, number of fixed shapes without boxes around others)."""


class MotionScene(NamedTuple):
    """One arm among fixed shapes. Frames as in `tcs.kernel.arrays`."""

    chain: MotionChain
    limits: ChainLimits
    shapes: MotionShapes
    pairs: ShapePairs
    leaves: LeafSpheres
    distances: DistanceTables
    """Tables of distances of bodies of the robot."""


class PlacedPosture(NamedTuple):
    """The arm at the current posture."""

    q: FloatArray
    """Joint angles [rad], shape (7,)."""
    number: IntArray
    """Number of the current posture, shape (1,)."""
    turns: FloatArray
    """Scratch of `place_links`, shape (3, LANES)."""
    link_R: FloatArray
    """Orientations of A, L1..L7 and the links between coupled joints in A, shape
    (8 + coupled, 3, 3)."""
    link_p: FloatArray
    """Origins of A, L1..L7 and the links between coupled joints in A [m], shape
    (8 + coupled, 3)."""
    shapes: FloatArray
    """All shapes in A, packed, shape (n_arm + n_fixed, 17)."""
    placed: IntArray
    """Number of the posture for which each shape of the arm was placed, shape (n_arm,)."""


class PieceMotion(NamedTuple):
    """Motion on the current piece of a curve, whose middle is the current posture."""

    known: IntArray
    """1 if joints move on the piece, `separating_planes.TWISTED` if their motion to first order is
    known too, else 0; shape (1,)."""
    delta: FloatArray
    """Greatest distance of each joint from the current posture [rad], shape (7,)."""
    rate: FloatArray
    """Motion of each joint on half of the piece, to first order [rad], shape (7,)."""
    bend: FloatArray
    """Bound on twice the motion of each joint beyond the first order [rad], shape (7,)."""
    motion: FloatArray
    """Bound on how far any point of a shape moves, relative to each link before its own [m], shape
    (n_arm, 8 + coupled)."""
    rest: FloatArray
    """Bound on how far any point of a shape is from where its twist at the middle posture leads to,
    relative to each link before its own [m], shape (n_arm, 8 + coupled)."""
    twist: FloatArray
    """Motion of the links on half of the piece, see `separating_planes`, shape (8 + coupled, 6)."""
    line: FloatArray
    """Straight motion of the tool on the current curve, see `tool_line`, shape (5,)."""
    tool_twist: FloatArray
    """Motion of the links 0 .. 7 as `twist`, but as seen from the tool on that line, shape
    (8, 6)."""
    by_tool: BoolArray
    """Whether the first row of `rest` bounds what `tool_twist` leaves, not `twist`, shape
    (n_arm,)."""


class BezierCurve(NamedTuple):
    """The current curve: cubic Bezier curves, one after the other."""

    control: FloatArray
    """Control points, the last one of each piece being the first one of the next [rad], shape
    (3 * MOST_PIECES + 1, 7)."""
    pieces: IntArray
    """Number of pieces, a power of two, shape (1,)."""


class UncertifiedPairs(NamedTuple):
    """Pieces of the current curve that are not certified yet, and the pairs to check on them."""

    pairs: IntArray
    """Lists of pairs, shape (LISTED + (DEPTH + 2) * n_pairs,)."""
    stack: IntArray
    """Stack of pairs whose pairs below are checked next, shape (STACK,)."""
    span: FloatArray
    """Pieces of the curve to certify: begin and end, in [0, 1], shape (WIDE + 2 * DEPTH, 2)."""
    stretch: IntArray
    """First pair and one after the last pair of each piece in `span`, shape as `span`."""


class Separation(NamedTuple):
    """Scratch of the comparisons of bounding spheres and of boxes."""

    apart: FloatArray
    """Squared distance of the bounding spheres of pairs, less the square of what they must keep
    [m^2], shape (GROUP,)."""
    excess: FloatArray
    """Squared distance of the bounding spheres of a link's shapes from the core of that shape, less
    the square of what they must keep [m^2], shape (n_leaf,)."""
    other: FloatArray
    """The fixed shape that these are compared with, in the frame of a link: its three axes, the
    link's origin from its centre along them, and the half sizes of its core [m], shape (5, 3)."""
    between: FloatArray
    """Axes of a link's frame and its origin along the axes of boxes around fixed shapes, and these
    axes in A, see `near_pairs`, shape (3, 7)."""


class FoundContacts(NamedTuple):
    """Pairs found in contact."""

    pair: IntArray
    """The pair found last, NO_PAIR for none, shape (1,)."""
    met: FloatArray
    """Where on the curve that pair blocks it, in [0, 1], shape (1,)."""
    hits: IntArray
    """How often pairs of each two bodies blocked a curve, shape (n_bodies, n_bodies): that of the
    arm's shape first."""


class MotionWorkspace(NamedTuple):
    """Scratch of one worker, reused from curve to curve."""

    posture: PlacedPosture
    piece: PieceMotion
    curve: BezierCurve
    uncertified: UncertifiedPairs
    separation: Separation
    contacts: FoundContacts


def motion_scene(problem: Problem, row: Rows) -> MotionScene:
    """Return a scene at one initial configuration, prepared for motions.

    Args:
        problem: The scene.
        row: The configuration.
    """
    return placed(torso_scene(problem, int(row.torso[0])), problem, row)


def torso_scene(problem: Problem, torso: int) -> MotionScene:
    """Return a scene at a torso level, with its environment in no particular place.

    Which pairs are checked is the same at all configurations of that level, and so are the boxes
    around groups of shapes: `placed` places what else there is.

    Args:
        problem: The scene.
        torso: The torso level.
    """
    # The boxes around groups of shapes come after the shapes, and are left out.
    count, others = len(problem.links.body), len(problem.body.body)
    fixed = np.concatenate([problem.environment.shapes[0], problem.body.shapes_A[torso, :others]])
    gap_fixed = np.concatenate(
        [problem.clearances.environment[:count], problem.clearances.body[:count, :others]], axis=1
    )
    links = np.ascontiguousarray(problem.links.shapes[:count])
    link_frame = np.ascontiguousarray(problem.links.frame[:count])
    away = depth(link_frame, problem.chain.coupled)
    apart = away[:, None] > away
    gaps = np.concatenate([gap_fixed, problem.clearances.arm[:count, :count] * apart], axis=1)
    arm, other = np.nonzero(gaps > 0.0)
    number = np.concatenate([count + np.arange(len(fixed)), np.arange(count)])
    carrying = np.concatenate([np.zeros(len(fixed), np.int64), link_frame])
    pair = np.stack([arm, number[other], carrying[other]], axis=1)
    lower, upper = problem.arm.lower.copy(), problem.arm.upper.copy()
    lower[: 7 - problem.chain.joints] = upper[: 7 - problem.chain.joints] = 0.0
    slides = chain_of(problem).slides
    farthest = _farthest(problem, links, link_frame)
    reach = np.where(slides > 0.0, slides, farthest)
    return MotionScene(
        chain=MotionChain(
            R=problem.chain.R,
            p=problem.chain.p,
            slides=slides,
            coupled=problem.chain.coupled,
            reach=reach,
            weight=(reach / reach.max()) ** 2,
            aside=float(farthest[SEEN_FROM_TOOL - 1]),
            free_axis=problem.goals.turn,
        ),
        limits=ChainLimits(
            lower=lower,
            upper=upper,
            period=np.where(np.isfinite(lower) & np.isfinite(upper), 0.0, FULL_TURN),
        ),
        shapes=MotionShapes(
            links=links,
            link_frame=link_frame,
            fixed=fixed,
            body=np.concatenate(
                [
                    problem.links.body + problem.environment.bodies,
                    problem.environment.body,
                    problem.body.body + problem.environment.bodies,
                ]
            ),
            robot=problem.environment.bodies,
            boxes=np.array([count, count + len(fixed)]),
            root=np.arange(count),
        ),
        pairs=shape_pairs(links, fixed, pair, gaps[arm, other]),
        leaves=LeafSpheres(
            spheres=np.zeros((4, 0)),
            span=np.zeros((count, 2), np.int64),
            shape=np.zeros(0, np.int64),
            pair=np.zeros((0, len(fixed)), np.int64),
        ),
        distances=problem.distances,
    )


def placed(scene: MotionScene, problem: Problem, row: Rows) -> MotionScene:
    """Return a scene with its environment as at one initial configuration.

    Args:
        scene: From `torso_scene` of the configuration's torso level, with all pairs or some, with
            groups or without; or from this function.
        problem: The scene.
        row: The configuration.
    """
    shapes, pairs = scene.shapes, scene.pairs
    R_WA, p_WA = arm_base(problem, row)
    environment = moved_shapes(problem.environment.shapes[row.state[0]], R_WA.T, -R_WA.T @ p_WA)
    fixed = np.concatenate([environment, shapes.fixed[len(environment) :]])
    always = pairs.members[: pairs.first[-1]]
    centre = _centres(always, len(shapes.links), fixed)
    return scene._replace(shapes=shapes._replace(fixed=fixed), pairs=pairs._replace(centre=centre))


def arm_base(problem: Problem, row: Rows) -> tuple[FloatArray, FloatArray]:
    """Return X_WA at one configuration: orientation (3, 3) and origin (3,) [m] of the arm base."""
    c, s, torso = np.cos(row.yaw[0]), np.sin(row.yaw[0]), row.torso[0]
    R_WB = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    p_WB = np.array([row.x[0], row.y[0], 0.0])
    return R_WB @ problem.arm_base.R[torso], p_WB + R_WB @ problem.arm_base.p[torso]


def goal_from_arm_base(problem: Problem, row: Rows, goal: int) -> tuple[FloatArray, FloatArray]:
    """Return X_AG of a goal at one configuration: orientation (3, 3) and position (3,) [m].

    Of a goal that has several poses it is the first.
    """
    R_WA, p_WA = arm_base(problem, row)
    state, pose = row.state[0], problem.goals.poses_of(goal)[0]
    R_AG = np.ascontiguousarray(R_WA.T @ problem.goals.R[state, pose])
    return R_AG, R_WA.T @ (problem.goals.p[state, pose] - p_WA)


def carriers(problem: Problem) -> IntArray:
    """Return what carries each fixed shape of a scene, shape (n_fixed,), as `grouped` takes it.

    Shapes of the environment are grouped with no others, those of the robot by their mount.
    """
    return np.concatenate([np.full(problem.environment.body.size, -1), problem.body.mount])


def with_pairs(scene: MotionScene, kept: BoolArray | IntArray) -> MotionScene:
    """Return a scene with some of its pairs only, those `kept`: a mask or ascending numbers."""
    shapes, pairs = scene.shapes, scene.pairs
    some = shape_pairs(shapes.links, shapes.fixed, pairs.members[kept], pairs.gap[kept])
    return scene._replace(pairs=some)


def shape_pairs(
    links: FloatArray,
    fixed: FloatArray,
    pair: IntArray,
    gap: FloatArray,
    below: IntArray | None = None,
    top: int | None = None,
) -> ShapePairs:
    """Return the pairs of a scene.

    Args:
        links: The arm's shapes, packed, shape (n_arm, 17).
        fixed: Fixed shapes, packed, shape (n_fixed, 17).
        pair: Pairs, shape (n_pairs, 3). Those checked always come first, sorted by their first
            shape; the pairs of a shape of the arm begin with those with fixed shapes.
        gap: Distance that each pair must keep [m], shape (n_pairs,).
        below: Pairs below each pair, shape (n_pairs, 2); None without groups.
        top: Number of pairs that are checked always; all if None.
    """
    always = pair[:top]
    first_pair = np.searchsorted(always[:, 0], np.arange(len(links) + 1)).astype(np.int64)
    of_two_links = always[:, 2] > 0
    fixed_pairs = np.bincount(always[~of_two_links, 0], minlength=len(links))
    roots = np.arange(len(links))
    if below is not None:
        roots = np.union1d(always[:, 0], always[of_two_links, 1])
    radius = np.concatenate([links[:, BOUND], fixed[:, BOUND]])
    return ShapePairs(
        members=np.ascontiguousarray(pair),
        roots=roots.astype(np.int64),
        first=first_pair,
        first_moving=first_pair[:-1] + fixed_pairs,
        below=np.zeros((0, 2), np.int64) if below is None else below,
        centre=_centres(always, len(links), fixed),
        bound=radius[pair[:, 0]] + radius[pair[:, 1]],
        gap=np.ascontiguousarray(gap),
    )


def new_motion_workspace(scene: MotionScene) -> MotionWorkspace:
    """Return scratch memory for one worker."""
    arm, pairs, bodies = (
        len(scene.shapes.links),
        len(scene.pairs.members),
        int(scene.shapes.body.max()) + 1,
    )
    frames = FRAMES + len(scene.chain.coupled)
    shapes = np.zeros((arm + len(scene.shapes.fixed), COLUMNS))
    shapes[arm:] = scene.shapes.fixed
    return MotionWorkspace(
        posture=PlacedPosture(
            q=np.empty(7),
            number=np.zeros(1, np.int64),
            turns=np.zeros((3, LANES)),
            link_R=np.empty((frames, 3, 3)),
            link_p=np.empty((frames, 3)),
            shapes=shapes,
            placed=np.zeros(arm, np.int64),
        ),
        piece=PieceMotion(
            known=np.zeros(1, np.int64),
            delta=np.zeros(7),
            rate=np.zeros(7),
            bend=np.zeros(7),
            motion=np.zeros((arm, frames)),
            rest=np.zeros((arm, frames)),
            twist=np.zeros((frames, 6)),
            line=np.array([0.0, 0.0, 0.0, np.inf, 0.0]),
            tool_twist=np.zeros((8, 6)),
            by_tool=np.zeros(arm, np.bool_),
        ),
        curve=BezierCurve(control=np.empty((3 * MOST_PIECES + 1, 7)), pieces=np.ones(1, np.int64)),
        uncertified=UncertifiedPairs(
            pairs=np.empty(LISTED + (DEPTH + 2) * pairs, np.int64),
            stack=np.empty(STACK, np.int64),
            span=np.empty((WIDE + 2 * DEPTH, 2)),
            stretch=np.empty((WIDE + 2 * DEPTH, 2), np.int64),
        ),
        separation=Separation(
            apart=np.empty(GROUP),
            excess=np.empty(scene.leaves.spheres.shape[1]),
            other=np.empty((5, 3)),
            between=np.empty((3, 7)),
        ),
        contacts=FoundContacts(
            pair=np.full(1, NO_PAIR, np.int64),
            met=np.zeros(1),
            hits=np.zeros((bodies, bodies), np.int64),
        ),
    )


def moved_shapes(rows: FloatArray, R: FloatArray, p: FloatArray) -> FloatArray:
    """Return packed shapes moved by the pose (R, p)."""
    moved = rows.copy()
    moved[:, CENTRE : CENTRE + 3] = rows[:, CENTRE : CENTRE + 3] @ R.T + p
    turned = R @ rows[:, ROTATION:].reshape(-1, 3, 3)
    moved[:, ROTATION:] = turned.reshape(-1, 9)
    return moved


def _centres(pair: IntArray, links: int, fixed: FloatArray) -> FloatArray:
    """Return the centre of the fixed shape of each pair [m], 0 where both move, (3, n_pairs).

    Args:
        pair: Pairs, shape (n_pairs, 3).
        links: Number of shapes of the arm.
        fixed: Fixed shapes, packed, shape (n_fixed, 17).
    """
    centre = np.zeros((3, links + len(fixed)))
    centre[:, links:] = fixed[:, CENTRE : CENTRE + 3].T
    return centre.take(pair[:, 1], axis=1)


def depth(frame: IntArray, coupled: FloatArray) -> FloatArray:
    """Return the number of joints before links; links between coupled joints are after a part.

    Args:
        frame: Numbers of the links, shape (n,).
        coupled: As in `Chain`.
    """
    found: FloatArray = np.concatenate([np.arange(float(FRAMES)), coupled.sum(axis=1)])[frame]
    return found


def _farthest(problem: Problem, links: FloatArray, link_frame: IntArray) -> FloatArray:
    """Return how far from the origin of each link any point on or beyond it may be [m], (7,)."""
    chain = chain_of(problem)
    steps = np.linalg.norm(chain.p[:7], axis=1) + travel(chain)
    spans = np.concatenate([[0.0], np.cumsum(steps)])
    spans = np.append(spans, spans[problem.chain.coupled[:, 0].astype(np.int64) + 1])
    centre = np.linalg.norm(links[:, CENTRE : CENTRE + 3], axis=1)
    away, found = depth(link_frame, problem.chain.coupled), np.zeros(7)
    for k in range(1, 8):
        out = spans[link_frame] - spans[k] + centre + links[:, BOUND]
        found[k - 1] = np.max(np.where(away >= k, out, 0.0), initial=0.0)
    return found
