"""The arm, everything around it and the pairs to check, at one initial configuration."""

from __future__ import annotations

from typing import Any, NamedTuple

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


class MotionScene(NamedTuple):
    """One arm among fixed shapes. Frames as in `tcs.kernel.arrays`.

    Shapes are numbered: those of the arm first, in the order of `links`, then those of `fixed`.
    There are always seven joints: the first ones, which an arm of fewer lacks, remain at 0.
    Positions of prismatic joints are in [m] where [rad] is written.
    """

    chain_R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    chain_p: FloatArray
    """Translations of the chain [m], shape (8, 3); with a fourth column that holds `slides` if
    there are prismatic joints."""
    slides: FloatArray
    """Motion of each prismatic joint per unit [m/m], 0 for a revolute joint, shape (7,)."""
    coupled: FloatArray
    """Links between coupled joints, as in `Chain`, numbered from FRAMES on, shape (n, 2)."""
    lower: FloatArray
    """Lower joint limits [rad], shape (7,); -inf where continuous, 0 for one that remains at 0."""
    upper: FloatArray
    """Upper joint limits [rad], shape (7,); +inf where continuous, 0 for one that remains at 0."""
    period: FloatArray
    """A full turn for each continuous joint, 0 for the others [rad], shape (7,)."""
    reach: FloatArray
    """Bound on how far any point of the arm moves per unit of each joint: for a revolute one, how
    far it may be from the axis [m]; shape (7,)."""
    weight: FloatArray
    """Square of `reach` relative to its largest, shape (7,)."""
    aside: float
    """Bound on how far any point of the last links, from SEEN_FROM_TOOL on, may be from the origin
    of the first of them [m]."""
    links: FloatArray
    """The arm's shapes, packed, in link frames, shape (n_arm, 17)."""
    link_frame: IntArray
    """Link of each shape in `links`, 1 .. 7 or one between coupled joints, shape (n_arm,)."""
    fixed: FloatArray
    """Environment and rest of the robot, and boxes around groups of the latter, packed, in A, shape
    (n_fixed, 17)."""
    pair: IntArray
    """Checked pairs: shape of the arm, other shape, and link that carries the other shape, 0 if it
    is fixed; shape (n_pairs, 3). The other link is the one nearer to the base."""
    roots: IntArray
    """Shapes of the arm in the pairs that are checked always, or all, ascending."""
    first_pair: IntArray
    """First pair of each shape of the arm, and the number of pairs of all, shape (n_arm + 1,).
    Pairs beyond these are below others."""
    first_moving: IntArray
    """First pair of each shape of the arm with another shape of the arm: pairs with fixed shapes
    come before those; shape (n_arm,)."""
    below: IntArray
    """First and one after the last of the pairs below each pair, equal if there are none; shape
    (n_pairs, 2), or (0, 2) without groups. They are apart if the pair is, see `groups`."""
    centre: FloatArray
    """Centre in A of the fixed shape of each pair that is checked always [m], shape
    (3, those pairs); 0 where both move."""
    bound: FloatArray
    """Sum of the radii of the bounding spheres of each pair [m], shape (n_pairs,)."""
    gap: FloatArray
    """Distance that each pair must keep [m], shape (n_pairs,)."""
    body: IntArray
    """Body of each shape, shape (n_arm + n_fixed,): index among the bodies of the environment, or
    that of a robot body plus the number of bodies of the environment."""
    distances: DistanceTables
    """Tables of distances of bodies of the robot."""
    leaf: FloatArray
    """Centre and radius of the bounding sphere of each shape in a box around those of a link, in
    the frame of the link [m], box by box, shape (4, n_leaf)."""
    leaves: IntArray
    """First and one after the last of the columns of `leaf` that are in each shape of the arm that
    is a box in no other box, equal for others, shape (n_arm, 2)."""
    leaf_shape: IntArray
    """Number of each of these shapes, shape (n_leaf,)."""
    leaf_pair: IntArray
    """Pair of each column of `leaf` with each fixed shape, NO_PAIR if it is not checked, shape
    (n_leaf, number of fixed shapes without boxes around others)."""
    boxes: IntArray
    """Number of the arm's first box around others among its shapes, and of the first one around
    fixed shapes among all shapes, shape (2,)."""
    root: IntArray
    """Box around shapes of a link in which each shape of the arm is, itself if it is in none, shape
    (n_arm,)."""
    robot: int
    """Number of the first body of the robot in `body`."""
    turn: FloatArray
    """As in `Problem`: the axis about which straight motions may rotate the tool of an arm of five
    joints, in T, else zeros, shape (3,)."""


class MotionWorkspace(NamedTuple):
    """Scratch of one worker, reused from curve to curve."""

    q: FloatArray
    """Joint angles of the current posture [rad], shape (7,)."""
    turns: FloatArray
    """Scratch of `place_links`, shape (3, LANES)."""
    link_R: FloatArray
    """Orientations of A, L1..L7 and the links between coupled joints in A, shape
    (8 + coupled, 3, 3)."""
    link_p: FloatArray
    """Origins of A, L1..L7 and the links between coupled joints in A [m], shape
    (8 + coupled, 3)."""
    shapes: FloatArray
    """All shapes in A at the current posture, packed, shape (n_arm + n_fixed, 17)."""
    placed: IntArray
    """Number of the posture for which each shape of the arm was placed, shape (n_arm,)."""
    posture: IntArray
    """Number of the current posture, and 1 if joints move on the current piece, `planes.TWISTED`
    if their motion to first order is known too; shape (2,)."""
    delta: FloatArray
    """Greatest distance of each joint from the current posture on the current piece [rad],
    shape (7,)."""
    motion: FloatArray
    """Bound on how far any point of a shape moves on the current piece, relative to each link
    before its own [m], shape (n_arm, 8 + coupled)."""
    rest: FloatArray
    """Bound on how far any point of a shape is on the current piece from where its twist at the
    middle posture leads to, relative to each link before its own [m], shape (n_arm, 8 + coupled).
    """
    rate: FloatArray
    """Motion of each joint on half of the current piece, to first order [rad], shape (7,)."""
    bend: FloatArray
    """Bound on twice the motion of each joint beyond the first order [rad], shape (7,)."""
    twist: FloatArray
    """Motion of the links on half of the current piece, see `planes`, shape (8 + coupled, 6)."""
    line: FloatArray
    """Straight motion of the tool on the current curve, see `tool_line`, shape (5,)."""
    turn: FloatArray
    """Motion of the links 0 .. 7 as `twist`, but as seen from the tool on that line, shape
    (8, 6)."""
    by_tool: BoolArray
    """Whether the first row of `rest` bounds what `turn` leaves, not `twist`, shape (n_arm,)."""
    control: FloatArray
    """Control points of the pieces of the current curve, cubic Bezier curves, the last one of each
    being the first one of the next [rad], shape (3 * MOST_PIECES + 1, 7)."""
    pieces: IntArray
    """Number of these pieces, a power of two, shape (1,)."""
    met: FloatArray
    """Where on the curve the pair `contact` blocks it, in [0, 1], shape (1,)."""
    pairs: IntArray
    """Lists of pairs that are not certified yet, shape (LISTED + (DEPTH + 2) * n_pairs,)."""
    stack: IntArray
    """Stack of pairs whose pairs below are checked next, shape (STACK,)."""
    span: FloatArray
    """Pieces of the curve to certify: begin and end, in [0, 1], shape (WIDE + 2 * DEPTH, 2)."""
    stretch: IntArray
    """First pair and one after the last pair of each piece in `span`, shape as `span`."""
    excess: FloatArray
    """Squared distance of the bounding spheres of a link's shapes from the core of that shape, less
    the square of what they must keep [m^2], shape (n_leaf,)."""
    other: FloatArray
    """The fixed shape that `leaves` compares with, in the frame of a link: its three axes, the
    link's origin from its centre along them, and the half sizes of its core [m], shape (5, 3)."""
    apart: FloatArray
    """Squared distance of the bounding spheres of pairs, less the square of what they must keep
    [m^2], shape (GROUP,)."""
    between: FloatArray
    """Axes of a link's frame and its origin along the axes of boxes around fixed shapes, and these
    axes in A, see `group_boxes`, shape (3, 7)."""
    contact: IntArray
    """The pair found in contact last, -1 for none, shape (1,)."""
    hits: IntArray
    """How often pairs of each two bodies blocked a curve, shape (n_bodies, n_bodies): that of the
    arm's shape first."""


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
        chain_R=problem.chain.R,
        chain_p=problem.chain.p,
        slides=slides,
        coupled=problem.chain.coupled,
        lower=lower,
        upper=upper,
        period=np.where(np.isfinite(lower) & np.isfinite(upper), 0.0, FULL_TURN),
        reach=reach,
        weight=(reach / reach.max()) ** 2,
        aside=float(farthest[SEEN_FROM_TOOL - 1]),
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
        distances=problem.distances,
        leaf=np.zeros((4, 0)),
        leaves=np.zeros((count, 2), np.int64),
        boxes=np.array([count, count + len(fixed)]),
        root=np.arange(count),
        leaf_shape=np.zeros(0, np.int64),
        leaf_pair=np.zeros((0, len(fixed)), np.int64),
        robot=problem.environment.bodies,
        turn=problem.goals.turn,
        **pair_fields(links, fixed, pair, gaps[arm, other]),
    )


def placed(scene: MotionScene, problem: Problem, row: Rows) -> MotionScene:
    """Return a scene with its environment as at one initial configuration.

    Args:
        scene: From `torso_scene` of the configuration's torso level, with all pairs or some, with
            groups or without; or from this function.
        problem: The scene.
        row: The configuration.
    """
    R_WA, p_WA = arm_base(problem, row)
    environment = moved_shapes(problem.environment.shapes[row.state[0]], R_WA.T, -R_WA.T @ p_WA)
    fixed = np.concatenate([environment, scene.fixed[len(environment) :]])
    always = scene.pair[: scene.first_pair[-1]]
    return scene._replace(fixed=fixed, centre=_centres(always, len(scene.links), fixed))


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
    """Return what carries each fixed shape of a scene, shape (n_fixed,), as `groups` takes it.

    Shapes of the environment are grouped with no others, those of the robot by their mount.
    """
    return np.concatenate([np.full(problem.environment.body.size, -1), problem.body.mount])


def with_pairs(scene: MotionScene, kept: BoolArray | IntArray) -> MotionScene:
    """Return a scene with some of its pairs only, those `kept`: a mask or ascending numbers."""
    fields = pair_fields(scene.links, scene.fixed, scene.pair[kept], scene.gap[kept])
    return scene._replace(**fields)


def pair_fields(
    links: FloatArray,
    fixed: FloatArray,
    pair: IntArray,
    gap: FloatArray,
    below: IntArray | None = None,
    top: int | None = None,
) -> dict[str, Any]:
    """Return the fields of a scene that describe its pairs.

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
    return {
        "pair": np.ascontiguousarray(pair),
        "roots": roots.astype(np.int64),
        "below": np.zeros((0, 2), np.int64) if below is None else below,
        "first_pair": first_pair,
        "first_moving": first_pair[:-1] + fixed_pairs,
        "gap": np.ascontiguousarray(gap),
        "centre": _centres(always, len(links), fixed),
        "bound": radius[pair[:, 0]] + radius[pair[:, 1]],
    }


def new_motion_workspace(scene: MotionScene) -> MotionWorkspace:
    """Return scratch memory for one worker."""
    arm, pairs, bodies = len(scene.links), len(scene.pair), int(scene.body.max()) + 1
    frames = FRAMES + len(scene.coupled)
    shapes = np.zeros((arm + len(scene.fixed), COLUMNS))
    shapes[arm:] = scene.fixed
    return MotionWorkspace(
        q=np.empty(7),
        turns=np.zeros((3, LANES)),
        link_R=np.empty((frames, 3, 3)),
        link_p=np.empty((frames, 3)),
        shapes=shapes,
        placed=np.zeros(arm, np.int64),
        posture=np.zeros(2, np.int64),
        delta=np.zeros(7),
        motion=np.zeros((arm, frames)),
        rest=np.zeros((arm, frames)),
        rate=np.zeros(7),
        bend=np.zeros(7),
        twist=np.zeros((frames, 6)),
        line=np.array([0.0, 0.0, 0.0, np.inf, 0.0]),
        turn=np.zeros((8, 6)),
        by_tool=np.zeros(arm, np.bool_),
        control=np.empty((3 * MOST_PIECES + 1, 7)),
        pieces=np.ones(1, np.int64),
        met=np.zeros(1),
        pairs=np.empty(LISTED + (DEPTH + 2) * pairs, np.int64),
        stack=np.empty(STACK, np.int64),
        span=np.empty((WIDE + 2 * DEPTH, 2)),
        stretch=np.empty((WIDE + 2 * DEPTH, 2), np.int64),
        excess=np.empty(scene.leaf.shape[1]),
        other=np.empty((5, 3)),
        apart=np.empty(GROUP),
        between=np.empty((3, 7)),
        contact=np.full(1, NO_PAIR, np.int64),
        hits=np.zeros((bodies, bodies), np.int64),
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
