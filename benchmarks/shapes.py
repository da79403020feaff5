"""Compare the collision shapes of the shipped robots with their meshes, triangle by triangle.

Usage: python benchmarks/shapes.py [--robots pr2,baxter] [--postures 10000] [--exempt 500]
           [--seed 0]

Of random postures whose meshes are free of contact: the fraction that the shapes call blocked, by
self-collision and by random boxes, and the pairs that block most. A pair that a table of distances
shows to be apart is not blocked. Conversely: pairs that need no check whose meshes cross in some
postures. Arm and torso move within the joint limits, everything
else keeps its posture; what is outside a range of the robot file counts as blocked. Coal measures
the meshes. The results depend on the seed alone, not on the machine.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping

import coal
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from table import cell, header, parser, record, row, save

from tcs.kernel.collide import BOUND, CENTRE, ROTATION, closer
from tcs.model.robots import Primitive, RobotFile, load_robot, robot_names
from tcs.model.robots.distances import tables_in_force
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.surfaces import body_triangles, welded_top
from tcs_shapes.blocked import packed
from tcs_shapes.bodies import surfaces_to_enclose
from tcs_shapes.self_collision import sample_positions

FloatArray = NDArray[np.float64]
BodyPair = tuple[str, str]
Poses = dict[str, tuple[FloatArray, FloatArray]]
"""R_AB and p_AoBo_A of each body B in the root A, shapes (n, 3, 3) and (n, 3) [m]."""

BOXES = 3
"""Random boxes around the arm in each posture."""
EDGES = (0.02, 0.4)
"""Least and greatest edge of a box [m]."""
MARGIN = 0.001
"""Distance that robot and boxes must keep [m], the default of an environment."""
SHOWN = 3
"""Pairs named for each robot."""
_FEWEST = 0.0005
"""Least fraction of postures of a pair that is named."""


class Bodies:
    """Meshes and shapes of a robot's bodies."""

    def __init__(self, robot: RobotFile) -> None:
        """Read the meshes; a body that the robot file adds has its shapes instead."""
        self.robot = robot
        self.model = model_with_extras(robot)
        surfaces = {body: found[2] for body, found in surfaces_to_enclose(robot).items()}
        added = body_triangles(self.model)
        surfaces |= {body.name: added[body.name] for body in robot.bodies}
        self.meshes = {body: _bvh(triangles) for body, triangles in surfaces.items()}
        self._hulls = {
            body: ConvexHull(triangles.reshape(-1, 3)).equations
            for body, triangles in surfaces.items()
        }
        self.arm, self.hand = (self.model.links_moved_by(robot.arm_joints[i]) for i in (0, -1))
        self.shapes = [p for p in robot.load_primitives() if p.body in self.arm]

    def pairs(self) -> list[BodyPair]:
        """Return the pairs that scoring checks if they are not exempt."""
        return [
            (a, b)
            for a, b in itertools.combinations(sorted(self.meshes), 2)
            if self.arm & {a, b}
            and not {a, b} <= self.hand
            and welded_top(self.model, a)[0] != welded_top(self.model, b)[0]
        ]

    def are_apart(self, pair: BodyPair, poses: Poses, i: int) -> bool:
        """Return whether two meshes keep the self margin in posture i."""
        first, second = ((self.meshes[body], _pose(poses[body], i)) for body in pair)
        return _distance(*first, *second) >= self.robot.self_margin

    def is_free_of(
        self, body: str, poses: Poses, i: int, box: coal.Box, X_AB: coal.Transform3s
    ) -> bool:
        """Return whether a mesh keeps the margin to a box in posture i.

        A box whose centre is inside the hull of the mesh is not free: it may be within the surface.
        """
        R, p = poses[body][0][i], poses[body][1][i]
        faces = self._hulls[body]
        if np.all(faces[:, :3] @ (R.T @ (X_AB.getTranslation() - p)) + faces[:, 3] <= 0.0):
            return False
        return _distance(self.meshes[body], coal.Transform3s(R, p), box, X_AB) >= MARGIN


def main() -> None:
    """Measure, print and record everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default=",".join(robot_names()))
    command_line.add_argument("--postures", type=int, default=10_000)
    command_line.add_argument("--exempt", type=int, default=500, help="postures of exempt pairs")
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header("coal")
    row("postures, exempt pairs, seed", f"{options.postures}, {options.exempt}, {options.seed}")
    blocking: list[list[str]] = []
    crossing: list[list[str]] = []
    lines: list[str] = []
    for name in options.robots.split(","):
        shipped = load_robot(name)
        has_both = _has_soft_limits(shipped)
        for limits in ("soft", "hard") if has_both else (shipped.limits,):
            bodies = Bodies(shipped.with_choices(limits=limits))
            line = f"{name}, {limits} limits" if has_both else name
            lines.append(line)
            blocking += blocked(line, bodies, options.postures, options.seed)
            crossing += exempt(line, bodies, options.exempt, options.seed)
    record("pairs", ["robot", "contact of shapes alone", "postures [%]"], blocking)
    record("exempt", ["robot", "exempt pair whose meshes cross", "postures [%]"], crossing)
    save(options, keep=True, measured=lines)


def blocked(line: str, bodies: Bodies, postures: int, seed: int) -> list[list[str]]:
    """Print what shapes block although meshes are free, and return the worst pairs."""
    positions, poses = draw(bodies, postures, seed)
    robot, checked = bodies.robot, set(bodies.pairs())
    judge, limits = Contacts(bodies, poses, positions), robot.joint_limits()
    narrowed = {tuple(sorted(p)) for g in robot.disabled_groups if g.ranges for p in g.pairs}
    exempt_pairs = {tuple(sorted(pair)) for pair in robot.disabled_pairs}
    boxes = Boxes(bodies, poses, seed)
    counts: dict[str, Counter[str]] = {"self": Counter(), "boxes": Counter()}
    free, lost = Counter[str](), Counter[str]()
    for i in range(postures):
        at = {name: float(q[i]) for name, q in positions.items()}
        outside = {
            f"range of {name}"
            for name in robot.arm_joints
            if not limits[name][0] <= at[name] <= limits[name][1]
        }
        off = exempt_pairs - narrowed if outside else exempt_pairs
        touching = judge.touching(i, checked - off)
        if not all(bodies.are_apart(pair, poses, i) for pair in touching):
            continue
        struck = boxes.touching(i)
        own = outside or {" / ".join(pair) for pair in touching}
        for what, contacts in (("self", own), ("boxes", struck)):
            if contacts is not None:
                free[what] += 1
                lost[what] += bool(contacts)
                counts[what].update(contacts)
    for what, column in (("self", "self-collision"), ("boxes", "boxes")):
        text = f"{100.0 * lost[what] / max(1, free[what]):.2f}"
        row(f"{line}: blocked by {column} [%]", f"{text} of {free[what]}")
        cell("blocked", line, f"free of {column}", f"{free[what]:,}")
        cell("blocked", line, f"blocked by {column} [%]", text)
    return _named(line, counts["self"], free["self"]) + _named(
        line, Counter({f"{k} / box": n for k, n in counts["boxes"].items()}), free["boxes"]
    )


def exempt(line: str, bodies: Bodies, postures: int, seed: int) -> list[list[str]]:
    """Return the exempt pairs whose meshes cross, and in what fraction of postures.

    Pairs that cross in every posture are parts of one joint, and left out.
    """
    positions, poses = draw(bodies, postures, seed)
    limits = bodies.robot.joint_limits()
    within = [
        i
        for i in range(postures)
        if all(limits[n][0] <= positions[n][i] <= limits[n][1] for n in bodies.robot.arm_joints)
    ]
    off = {frozenset(pair) for pair in bodies.robot.disabled_pairs}
    counts = Counter[str]()
    for pair in bodies.pairs():
        if frozenset(pair) in off:
            first, second = (bodies.meshes[body] for body in pair)
            counts[" / ".join(pair)] = sum(
                _cross(first, _pose(poses[pair[0]], i), second, _pose(poses[pair[1]], i))
                for i in within
            )
    partly = Counter({pair: count for pair, count in counts.items() if count < len(within)})
    return _named(line, partly, len(within), shown=len(partly))


def draw(bodies: Bodies, postures: int, seed: int) -> tuple[dict[str, FloatArray], Poses]:
    """Return random positions of arm and torso by joint, shapes (n,), and the poses of bodies."""
    robot = bodies.robot
    rest = robot.with_mimics(robot.joint_positions())
    positions = {name: np.full(postures, q) for name, q in rest.items()}
    drawn = sample_positions(robot.without_ranges, postures, seed)
    for name in (*robot.arm_joints, *([robot.torso_joint] if robot.torso_joint else [])):
        positions[name] = np.array([sample[name] for sample in drawn])
    return positions, body_poses(bodies.model, positions, postures)


def body_poses(model: Urdf, positions: Mapping[str, FloatArray], postures: int) -> Poses:
    """Return the poses of all links in the root, for n positions of each joint [rad or m]."""
    poses: Poses = {
        model.root: (np.tile(np.eye(3), (postures, 1, 1)), np.zeros((postures, 3))),
    }

    def pose(link: str) -> tuple[FloatArray, FloatArray]:
        if link not in poses:
            joint = model.parent_joints[link]
            R, p = pose(joint.parent)
            p = p + R @ np.array(joint.xyz)
            R = R @ Rotation.from_euler("xyz", joint.rpy).as_matrix()
            axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
            if joint.type == "prismatic":
                p = p + (R @ axis) * positions[joint.name][:, None]
            elif joint.is_movable:
                turned = Rotation.from_rotvec(positions[joint.name][:, None] * axis)
                R = R @ turned.as_matrix()
            poses[link] = R, p
        return poses[link]

    for link in model.links:
        pose(link)
    return poses


class Contacts:
    """Pairs of bodies whose shapes are closer than the self margin.

    Those that a table of distances shows to be apart are not among them.
    """

    def __init__(self, bodies: Bodies, poses: Poses, positions: Mapping[str, FloatArray]) -> None:
        """Pack the shapes of each body, and place a ball around them in every posture."""
        self._poses, self._margin = poses, bodies.robot.self_margin
        self._positions = positions
        self._tables = {tuple(sorted(t.pair)): t for t in tables_in_force(bodies.robot)}
        shapes: dict[str, list[Primitive]] = {}
        for shape in bodies.robot.load_primitives():
            shapes.setdefault(shape.body, []).append(shape)
        self._shapes = {body: packed(own) for body, own in shapes.items()}
        self._balls = {body: self._ball(body) for body in shapes}

    def touching(self, i: int, pairs: Iterable[BodyPair]) -> set[BodyPair]:
        """Return which of some pairs of bodies have shapes in contact in posture i."""
        return {
            pair
            for pair in pairs
            if self._are_near(pair, i) and self._touch(pair, i) and not self._are_apart(pair, i)
        }

    def _are_apart(self, pair: BodyPair, i: int) -> bool:
        table = self._tables.get(pair)
        if table is None:
            return False
        at = {name: float(self._positions[name][i]) for name in table.joints}
        return table.bound(at) >= self._margin

    def _ball(self, body: str) -> tuple[FloatArray, float]:
        """Return the centres [m], shape (postures, 3), and the radius of a ball around a body."""
        rows, (R, p) = self._shapes[body], self._poses[body]
        centre = rows[:, CENTRE:ROTATION].mean(axis=0)
        away = np.linalg.norm(rows[:, CENTRE:ROTATION] - centre, axis=1)
        return R @ centre + p, float((away + rows[:, BOUND]).max())

    def _are_near(self, pair: BodyPair, i: int) -> bool:
        (first, reach), (second, more) = (self._balls[body] for body in pair)
        away = first[i] - second[i]
        return float(away @ away) < (reach + more + self._margin) ** 2

    def _touch(self, pair: BodyPair, i: int) -> bool:
        first, second = (self._shapes[body] for body in pair)
        (R_A, p_A), (R_B, p_B) = ((self._poses[b][0][i], self._poses[b][1][i]) for b in pair)
        R, p = R_A.T @ R_B, R_A.T @ (p_B - p_A)
        placed = second.copy()
        placed[:, CENTRE:ROTATION] = second[:, CENTRE:ROTATION] @ R.T + p
        placed[:, ROTATION:] = (R @ second[:, ROTATION:].reshape(-1, 3, 3)).reshape(-1, 9)
        away = first[:, None, CENTRE:ROTATION] - placed[None, :, CENTRE:ROTATION]
        reach = first[:, None, BOUND] + placed[:, BOUND] + self._margin
        near = np.argwhere(np.einsum("ijk,ijk->ij", away, away) < reach**2)
        return any(closer(first, j, placed, k, self._margin) for j, k in near.tolist())


class Boxes:
    """Random boxes about the arm, others in each posture."""

    def __init__(self, bodies: Bodies, poses: Poses, seed: int) -> None:
        """Draw the boxes within reach of the arm."""
        self._bodies, self._poses = bodies, poses
        robot = bodies.robot
        shoulder = poses[bodies.model.joints[robot.arm_joints[0]].child][1]
        tool = poses[bodies.model.joints[robot.arm_joints[-1]].child][1]
        rng = np.random.default_rng(seed)
        count = (len(shoulder), BOXES)
        reach = float(np.linalg.norm(tool - shoulder, axis=1).max())
        out = rng.normal(size=(*count, 3))
        out *= (reach * np.cbrt(rng.random(count)) / np.linalg.norm(out, axis=2))[..., None]
        self._p = shoulder[:, None] + out
        self._size = rng.uniform(*EDGES, (*count, 3))
        self._R = Rotation.random(count[0] * count[1], rng=rng).as_matrix().reshape(*count, 3, 3)
        self._shapes = [(p.body, _geometry(p), p.rotation) for p in bodies.shapes]
        self._centres = np.array([p.xyz for p in bodies.shapes])
        self._bounds = np.array([np.linalg.norm(_half_size(p)) for p in bodies.shapes])

    def touching(self, i: int) -> set[str] | None:
        """Return the bodies whose shapes touch a box in posture i, None if a mesh touches one."""
        found = set[str]()
        for R, p, size in zip(self._R[i], self._p[i], self._size[i], strict=True):
            box, X_AB = coal.Box(*size), coal.Transform3s(R, p)
            for body in self._struck(i, box, X_AB):
                if not self._bodies.is_free_of(body, self._poses, i, box, X_AB):
                    return None
                found.add(body)
        return found

    def _struck(self, i: int, box: coal.Box, X_AB: coal.Transform3s) -> set[str]:
        """Return the bodies of the arm whose shapes touch a box."""
        found = set[str]()
        R, p = (np.array([self._poses[body][k][i] for body, *_ in self._shapes]) for k in (0, 1))
        centres = np.einsum("nij,nj->ni", R, self._centres) + p
        reach = float(np.linalg.norm(box.halfSide)) + MARGIN
        away = np.linalg.norm(centres - X_AB.getTranslation(), axis=1)
        for k in np.flatnonzero(away <= reach + self._bounds):
            body, shape, R_BP = self._shapes[k]
            X_AP = coal.Transform3s(R[k] @ R_BP, centres[k])
            if body not in found and _distance(shape, X_AP, box, X_AB) < MARGIN:
                found.add(body)
        return found


def _named(line: str, counts: Counter[str], of: int, shown: int = SHOWN) -> list[list[str]]:
    """Print and return the most frequent contacts of a robot."""
    rows = [
        [line, name, f"{100.0 * count / max(1, of):.2f}"]
        for name, count in counts.most_common(shown)
        if count >= max(1.0, _FEWEST * of)
    ]
    for cells in rows:
        row(f"{line}: {cells[1]} [%]", cells[2])
    return rows


def _has_soft_limits(robot: RobotFile) -> bool:
    joints = robot.model().joints
    return any(joints[name].soft != joints[name].hard for name in robot.arm_joints)


def _bvh(triangles: FloatArray) -> coal.BVHModelOBBRSS:
    """Return triangles of shape (n, 3, 3) as a hierarchy of bounding volumes."""
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        points.append(corner)
    for a, b, c in index.reshape(-1, 3).tolist():
        faces.append(coal.Triangle(a, b, c))
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(points))
    model.addSubModel(points, faces)
    model.endModel()
    return model


def _geometry(shape: Primitive) -> coal.CollisionGeometry:
    classes = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere}
    return classes[shape.kind](*shape.size)


def _half_size(shape: Primitive) -> Iterable[float]:
    """Return half the sizes of a box around a shape [m]."""
    if shape.kind == "box":
        return [size / 2 for size in shape.size]
    length = shape.size[1] / 2 if shape.kind == "capsule" else 0.0
    return [shape.size[0], shape.size[0], shape.size[0] + length]


def _pose(poses: tuple[FloatArray, FloatArray], i: int) -> coal.Transform3s:
    return coal.Transform3s(poses[0][i], poses[1][i])


def _distance(
    a: coal.CollisionGeometry,
    X_A: coal.Transform3s,
    b: coal.CollisionGeometry,
    X_B: coal.Transform3s,
) -> float:
    return float(coal.distance(a, X_A, b, X_B, coal.DistanceRequest(), coal.DistanceResult()))


def _cross(
    a: coal.CollisionGeometry,
    X_A: coal.Transform3s,
    b: coal.CollisionGeometry,
    X_B: coal.Transform3s,
) -> bool:
    return bool(coal.collide(a, X_A, b, X_B, coal.CollisionRequest(), coal.CollisionResult()))


if __name__ == "__main__":
    main()
