"""How many postures the shapes of a robot block although its surfaces are free of contact."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, Shapes
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, closer, pack
from tcs.model.robots.distances import DistanceTable, tables_in_force
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf.pose import pose_in_root
from tcs_shapes.clearance import SPACING, SurfaceDistance, carried_surfaces
from tcs_shapes.self_collision import BodyPair, SelfCollision, sample_positions

FloatArray = NDArray[np.float64]
Pose = tuple[FloatArray, FloatArray]
"""Orientation, shape (3, 3), and position [m], shape (3,)."""

_PARTNER = "box"
_BOXES = 3
"""Random boxes around the arm in each posture."""
_EDGES = (0.02, 0.4)
"""Least and greatest edge of a box [m]."""
_MARGIN = 0.001
"""Distance that shapes and boxes must keep [m], the default of an environment."""
_TYPES = {"sphere": SPHERE, "capsule": CAPSULE, "box": BOX}
_FACTORS = {"sphere": (1.0, 1.0, 1.0), "capsule": (1.0, 0.5, 1.0), "box": (0.5, 0.5, 0.5)}
"""The kernel's half sizes over the sizes of a primitive."""


@dataclass(frozen=True)
class Blocked:
    """Postures that are free of contact by the surfaces, and those that shapes block.

    Attributes:
        free: Number of random postures whose surfaces are free of contact.
        blocked: Number of these in which shapes touch, or a joint is outside a range to which a
            group of disabled pairs keeps it.
        pairs: The pairs of bodies whose shapes touch, and in how many of these postures, most
            frequent first.
        partner: What the arm may touch: the robot itself, or random boxes.
    """

    free: int
    blocked: int
    pairs: tuple[tuple[BodyPair, int], ...]
    partner: str = "self-collision"

    @property
    def fraction(self) -> float:
        """Fraction of the free postures that shapes block, 0 without free postures."""
        return self.blocked / self.free if self.free else 0.0

    def worst(self, allowed: float) -> tuple[BodyPair, ...]:
        """Return the pairs that block most, as many as leave the others a fraction of postures.

        Args:
            allowed: Greatest fraction of the free postures that the others block together.
        """
        left = np.cumsum([count for _, count in self.pairs][::-1])[::-1]
        return tuple(
            pair
            for (pair, _), rest in zip(self.pairs, left, strict=True)
            if rest > allowed * self.free
        )

    def text(self) -> str:
        """Return the figures in one line, with the three worst pairs."""
        worst = "; ".join(
            f"{first} against {second} {count / self.free:.1%}"
            for (first, second), count in self.pairs[:3]
        )
        found = (
            f"of {self.free:,} random postures whose surfaces are free of {self.partner}, the "
            f"shapes block {self.fraction:.1%}"
        )
        return f"{found}: {worst}" if worst else found


def blocked_by_shapes(
    robot: RobotFile,
    *,
    postures: int = 300,
    seed: int = 0,
    surfaces: SurfaceDistance | None = None,
) -> Blocked:
    """Return how many postures the shapes block although the surfaces are free of contact.

    Arm and torso are drawn within the joint limits, everything else keeps its posture. Shapes
    enclose the surfaces, so only pairs whose shapes touch need the distance of the surfaces, which
    are sampled as points: a distance below their spacing counts as contact. Pairs that a table of
    distances shows to be apart do not touch. Postures outside the
    ranges of disabled groups are drawn too, and count as blocked if their surfaces are free.

    Args:
        robot: The robot.
        postures: Number of random postures.
        seed: Seed of the draws.
        surfaces: Its surfaces, as of `carried_surfaces`, if they are known.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    model = model_with_extras(robot)
    surfaces = surfaces or carried_surfaces(robot)
    limits, off = robot.joint_limits(), {frozenset(pair) for pair in robot.disabled_pairs}
    narrowed = {frozenset(p) for g in robot.disabled_groups if g.ranges for p in g.pairs}
    plant = SelfCollision(robot)
    plant.ignore_unscored(model, robot.arm_joints)
    plant.ignore(pair for pair in robot.disabled_pairs if frozenset(pair) not in narrowed)
    tables = {frozenset(table.pair): table for table in tables_in_force(robot)}
    free = blocked = 0
    pairs = Counter[BodyPair]()
    for positions in drawn_positions(robot, postures, seed):
        is_within = all(limits[n][0] <= positions[n] <= limits[n][1] for n in robot.arm_joints)
        exempt = off if is_within else off - narrowed
        touching = [
            pair
            for pair in plant.touching(positions)
            if frozenset(pair) not in exempt
            and not _are_apart(tables.get(frozenset(pair)), positions, robot.self_margin)
        ]
        if any(surfaces.distance(pair, positions) < SPACING for pair in touching):
            continue
        free += 1
        blocked += bool(touching) or not is_within
        pairs.update(touching)
    return Blocked(free, blocked, ranked(pairs))


def _are_apart(table: DistanceTable | None, positions: Mapping[str, float], margin: float) -> bool:
    """Return whether a table shows that two surfaces keep a margin [m]."""
    return table is not None and table.bound(positions) >= margin


def drawn_positions(robot: RobotFile, postures: int, seed: int) -> Iterator[Mapping[str, float]]:
    """Yield random positions of arm and torso, all other joints at those of the robot file.

    Args:
        robot: The robot; ranges of its disabled groups are ignored.
        postures: Number of postures.
        seed: Seed of the draws.
    """
    others = robot.with_mimics(robot.joint_positions())
    scored = [*robot.arm_joints, *([robot.torso_joint] if robot.torso_joint else [])]
    for sample in sample_positions(robot.without_ranges, postures, seed):
        yield others | {name: sample[name] for name in scored}


def ranked(pairs: Counter[BodyPair]) -> tuple[tuple[BodyPair, int], ...]:
    """Return pairs with their counts, the most frequent first."""
    return tuple(sorted(pairs.items(), key=lambda item: (-item[1], item[0])))


def blocked_at_boxes(
    robot: RobotFile,
    *,
    postures: int = 300,
    seed: int = 0,
    surfaces: SurfaceDistance | None = None,
) -> Blocked:
    """Return how many postures the arm's shapes block at random boxes that its surface clears.

    Three boxes with edges of 2 to 40 cm are anywhere within reach of the arm, others in each
    posture. The surface is sampled as points: a box closer to one than their spacing counts as
    touching, and so does a box whose centre is within the convex hull of a body.

    Args:
        robot: The robot.
        postures: Number of random postures.
        seed: Seed of the draws.
        surfaces: Its surfaces, as of `carried_surfaces`, if they are known.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    model = model_with_extras(robot)
    surfaces = surfaces or carried_surfaces(robot)
    moved = model.links_moved_by(robot.arm_joints[0])
    primitives = robot.load_primitives()
    shapes = {
        body: packed([shape for shape in primitives if shape.body == body])
        for body in {shape.body for shape in primitives} & moved
        if surfaces.has(body)
    }
    first, last = (model.joints[robot.arm_joints[i]].child for i in (0, -1))
    drawn = [
        {body: pose_in_root(model, body, positions) for body in {*shapes, first, last}}
        for positions in drawn_positions(robot, postures, seed)
    ]
    starts = [poses[first][1] for poses in drawn]
    reach = max(float(np.linalg.norm(poses[last][1] - poses[first][1])) for poses in drawn)
    rng = np.random.default_rng(seed)
    free = blocked = 0
    pairs = Counter[BodyPair]()
    faces: dict[str, FloatArray] = {}
    for poses, start in zip(drawn, starts, strict=True):
        found = set[str]()
        for _ in range(_BOXES):
            box = _random_box(rng, start, reach)
            struck = {body for body in shapes if _touch(shapes[body], poses[body], box)}
            for body in struck - faces.keys():
                faces[body] = _hull_faces(surfaces.points(body))
            if any(
                _surface_touches(surfaces.points(body), faces[body], poses[body], box)
                for body in struck
            ):
                break
            found |= struck
        else:
            free += 1
            blocked += bool(found)
            pairs.update((body, _PARTNER) for body in found)
    return Blocked(free, blocked, ranked(pairs), "random boxes")


def _random_box(rng: np.random.Generator, centre: FloatArray, reach: float) -> FloatArray:
    """Return a box within reach of a point, packed, shape (17,)."""
    out = rng.normal(size=3)
    out *= reach * np.cbrt(rng.random()) / np.linalg.norm(out)
    half = rng.uniform(*_EDGES, 3) / 2
    R = Rotation.random(rng=rng).as_matrix()
    return np.asarray(pack(_shapes([BOX], [half], [R], [centre + out]))[0, 0])


def packed(primitives: list[Primitive]) -> FloatArray:
    """Return primitives of one body in its frame, packed, shape (n, 17)."""
    sizes = []
    for shape in primitives:
        size = np.zeros(3)
        size[: len(shape.size)] = shape.size
        sizes.append(size * np.array(_FACTORS[shape.kind]))
    types = [_TYPES[shape.kind] for shape in primitives]
    R, p = ([getattr(s, name) for s in primitives] for name in ("rotation", "xyz"))
    return np.asarray(pack(_shapes(types, sizes, R, p))[0])


def _shapes(types: list[int], sizes: list[FloatArray], R: list[FloatArray], p: list[Any]) -> Shapes:
    n = len(types)
    return Shapes(
        type=np.array(types, np.int8),
        size=np.array(sizes),
        pad=np.zeros(n),
        body=np.zeros(n, np.int16),
        frame=np.zeros(n, np.int8),
        R=np.array(R)[None],
        p=np.array(p, np.float64)[None],
    )


def _touch(shapes: FloatArray, pose: Pose, box: FloatArray) -> bool:
    """Return whether any of the packed shapes of a body at a pose is closer to a box than 1 mm."""
    R, p = pose
    centres = shapes[:, CENTRE : CENTRE + 3] @ R.T + p
    away = np.linalg.norm(centres - box[CENTRE : CENTRE + 3], axis=1)
    near = away < shapes[:, BOUND] + box[BOUND] + _MARGIN
    rows = shapes[near]
    rows[:, CENTRE : CENTRE + 3] = centres[near]
    rows[:, ROTATION:] = (R @ rows[:, ROTATION:].reshape(-1, 3, 3)).reshape(-1, 9)
    return any(closer(rows, i, box[None], 0, _MARGIN) for i in range(len(rows)))


def _hull_faces(points: FloatArray) -> FloatArray:
    """Return the faces of the convex hull of points, normal and offset, shape (n, 4).

    A flat hull has a single face that contains no point.
    """
    try:
        return np.asarray(ConvexHull(points).equations)
    except QhullError:
        return np.array([[0.0, 0.0, 0.0, 1.0]])


def _surface_touches(points: FloatArray, faces: FloatArray, pose: Pose, box: FloatArray) -> bool:
    """Return whether points of a surface at a pose are close to a box, or enclose its centre.

    Args:
        points: Points of the surface of a body in its frame [m], shape (n, 3).
        faces: Faces of their convex hull, shape (m, 4).
        pose: Pose of the body.
        box: Packed, shape (17,).
    """
    R, p = pose
    centre, R_box = box[CENTRE : CENTRE + 3], box[ROTATION:].reshape(3, 3)
    seen = (points @ R.T + p - centre) @ R_box
    away = np.linalg.norm(np.maximum(np.abs(seen) - box[SIZE : SIZE + 3], 0.0), axis=1)
    if away.min() < SPACING:
        return True
    return bool(np.all(faces[:, :3] @ (R.T @ (centre - p)) + faces[:, 3] <= 0.0))
