"""Tables of distances of a robot, measured on its meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.distances import FARTHEST, UNIT, DistanceTable, source_digest
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs_shapes.clearance import carried_triangles, joints_between
from tcs_shapes.self_collision import BodyPair, SelfCollision, sample_positions
from tcs_shapes.surface_pair import SurfacePair

FloatArray = NDArray[np.float64]
Joints = tuple[str, str]
"""Two joints of an arm, the one nearer to the base first; the same one twice if it is alone."""

LOSSES = (2e-5, 1e-3)
"""Least and greatest mean loss of the bound in a cell where the surfaces are `KEPT` apart [m]."""
KEPT = 0.001
"""Distance of surfaces, near the usual margin, at which that loss is counted [m]."""
LOST = 1e-4
"""Share of postures that a table may block although the surfaces are free, which decides between
these."""
_NEAR = 0.003
"""Distance beyond the margin up to which free postures are counted for that [m]."""
MOST = 1 << 22
"""Greatest number of corners of cells of a table, up to whole blocks."""
TOUCHING = 0.005
"""Gap up to which shapes count as touching [m]: a margin of the robot file may be as wide."""
ENOUGH = 0.003
"""Distance [m] all over a block of corners above which they are not measured one by one."""
LEAST_SHARE = 5e-4
"""Least share of postures that a pair blocks by its shapes alone for which it gets a table."""
BLOCKS = (64, 16, 4, 1)
"""Corners along the edges of the blocks that are measured, coarse blocks first."""
ROUNDING = 1e-6
"""Subtracted from measured distances [m], above rounding errors."""


def measured_tables(
    robot: RobotFile,
    *,
    postures: int = 10_000,
    seed: int = 0,
    only: Collection[frozenset[str]] | None = None,
    on_pair: Callable[[BodyPair, float], None] = lambda pair, share: None,
) -> tuple[DistanceTable, ...]:
    """Return tables of the pairs of bodies whose shapes block postures that their surfaces do not.

    Only pairs of `table_pairs` are looked at. With three joints between them, one body counts as
    all that it sweeps as the joint next to it turns: that costs little where it is round.

    Args:
        robot: The robot.
        postures: Random postures that decide which pairs get a table.
        seed: Seed of the draws.
        only: Pairs to look at, all if left out.
        on_pair: Called with each pair that gets a table before it is measured, and the share of
            postures that its shapes block alone.

    Raises:
        RobotError: If a mesh cannot be read, or the package `coal` is missing.
    """
    carried = carried_triangles(robot, model_with_extras(robot))
    surfaces = {
        pair: [SurfacePair.of(robot, pair, carried, joints) for joints in choices]
        for pair, choices in table_pairs(robot).items()
        if set(pair) <= carried.keys() and (only is None or frozenset(pair) in only)
    }
    tables = []
    for surface, free in _blocking(robot, surfaces, postures, seed):
        share = len(free) / postures
        if share >= LEAST_SHARE:
            on_pair(surface.pair, share)
            near = np.count_nonzero(free < robot.self_margin + _NEAR) / postures
            loss = float(np.clip(LOST * _NEAR / max(near, 1.0 / postures), *LOSSES))
            tables.append(measured_table(surface, robot, loss))
    return tuple(tables)


def table_pairs(robot: RobotFile) -> Mapping[BodyPair, tuple[Joints, ...]]:
    """Return the checked pairs of bodies with up to three revolute joints of the arm between them.

    Returns:
        By pair, the body nearer to the base first: the joints over which a table can be, of three
        without the first, or without the last.
    """
    model = model_with_extras(robot)
    bodies = sorted({shape.body for shape in robot.load_primitives()})
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    order = {name: n for n, name in enumerate(robot.arm_joints)}
    hand = model.links_moved_by(robot.arm_joints[-1])
    found: dict[BodyPair, tuple[Joints, ...]] = {}
    for second in bodies:
        for first in bodies:
            joints = joints_between(model, first, second)
            if not (
                1 <= len(joints) <= 3
                and all(joint.name in order for joint in joints)
                and all(joint.type in ("revolute", "continuous") for joint in joints)
                and frozenset((first, second)) not in off
                and not {first, second} <= hand
            ):
                continue
            names = sorted((joint.name for joint in joints), key=order.__getitem__)
            if second in model.links_moved_by(names[0]):
                parts = names[:2], names[-2:]
                found[first, second] = tuple(dict.fromkeys((part[0], part[-1]) for part in parts))
    return found


def _blocking(
    robot: RobotFile,
    surfaces: Mapping[BodyPair, list[SurfacePair]],
    postures: int,
    seed: int,
) -> Iterator[tuple[SurfacePair, FloatArray]]:
    """Yield the distances of each pair's surfaces where its shapes touch and all are free [m].

    Free are postures in which no pair is in contact by its surfaces, of those that are looked at.
    Of several choices of joints, those of the choice that shows most of the postures to be free.
    """
    plant = SelfCollision(robot)
    plant.ignore_unscored(model_with_extras(robot), robot.arm_joints)
    of_names = {frozenset(pair): pair for pair in surfaces}
    every = sorted(plant.bodies)
    plant.ignore(
        (a, b) for a in every for b in every if a < b and frozenset((a, b)) not in of_names
    )
    found: dict[BodyPair, list[list[float]]] = {
        pair: [[] for _ in choices] for pair, choices in surfaces.items()
    }
    enough = robot.self_margin + 2.0 * _NEAR
    for positions in sample_positions(robot, postures, seed):
        touching = {
            pair: [
                surface.distance(*surface.angles(positions), enough) for surface in surfaces[pair]
            ]
            for pair in (of_names[frozenset(names)] for names in plant.touching(positions))
        }
        if any(max(distances) < robot.self_margin for distances in touching.values()):
            continue
        for pair, distances in touching.items():
            for free, distance in zip(found[pair], distances, strict=True):
                if distance >= robot.self_margin:
                    free.append(distance)
    for pair, choices in surfaces.items():
        best = int(np.argmax([len(distances) for distances in found[pair]]))
        yield choices[best], np.array(found[pair][best])


def measured_table(surfaces: SurfacePair, robot: RobotFile, loss: float) -> DistanceTable:
    """Return the table, measured where a joint can be within its hard limits.

    Args:
        surfaces: The surfaces.
        robot: The robot.
        loss: What the bound loses in the mean over a cell where the surfaces are `KEPT` apart [m];
            more if the table would have more than `MOST` corners.
    """
    reach = surfaces.reach()
    limits = robot.with_choices(limits="hard").without_ranges.joint_limits()
    width = max(_width(loss), 2.0 * math.pi * math.sqrt(reach[0] * reach[1] / MOST))
    blocks = [max(1, math.ceil(2.0 * math.pi * r / (width * BLOCKS[0]))) for r in reach]
    if surfaces.is_of_one_joint:
        count = (blocks[0] * BLOCKS[0], 1)
    else:
        count = (blocks[0] * BLOCKS[0], blocks[1] * BLOCKS[0])
    steps = (2.0 * math.pi / count[0], 2.0 * math.pi / count[1])
    allowed = [
        _reachable(n, step, limits[name])
        for n, step, name in zip(count, steps, surfaces.joints, strict=True)
    ]
    if surfaces.is_of_one_joint:
        allowed[1] = np.ones(1, np.bool_)
    corners = np.zeros(count, np.uint8)
    wanted = np.ones([math.ceil(n / BLOCKS[0]) for n in count], np.bool_)
    for level, edge in enumerate(BLOCKS):
        wanted = _measure(surfaces, corners, wanted, edge, steps, reach, allowed)
        if level + 1 < len(BLOCKS):
            finer = edge // BLOCKS[level + 1]
            wanted = wanted.repeat(finer, axis=0)
            wanted = wanted if surfaces.is_of_one_joint else wanted.repeat(finer, axis=1)
    return DistanceTable(
        pair=surfaces.pair,
        joints=surfaces.joints,
        reach=reach,
        corners=corners,
        source=source_digest(robot, surfaces.pair),
    )


def _width(loss: float) -> float:
    """Return how far a joint moves a point at its reach from corner to corner, for a mean loss [m].

    By `DistanceTable.bound`, the square of the distance loses `width^2 t (1 - t)` for either of two
    joints, `width^2 / 6` in the mean, and the distance as much over its double.
    """
    return math.sqrt(6.0 * KEPT * loss)


def _measure(
    surfaces: SurfacePair,
    corners: NDArray[np.uint8],
    wanted: NDArray[np.bool_],
    edge: int,
    steps: tuple[float, float],
    reach: tuple[float, float],
    allowed: list[NDArray[np.bool_]],
) -> NDArray[np.bool_]:
    """Measure blocks of corners at their middle; fill the corners of those that are far apart.

    Args:
        surfaces: The surfaces.
        corners: Filled, as in `DistanceTable`.
        wanted: Which blocks to measure.
        edge: Corners along the edges of a block.
        steps: Edges of a cell [rad].
        reach: From `reach`.
        allowed: Whether the joints can be in a cell at each corner.

    Returns:
        The blocks whose parts have to be measured.
    """
    edges = (edge, 1 if surfaces.is_of_one_joint else edge)
    found = np.full(wanted.shape, np.inf)
    # At the corners at the edges of the block.
    lost = sum(0.5 * r * step * (n - 1) for r, step, n in zip(reach, steps, edges, strict=True))
    # At the far edges of the cells around the block.
    slack = sum(0.5 * r * step * (n + 1) for r, step, n in zip(reach, steps, edges, strict=True))
    for i, j in np.argwhere(wanted):
        rows = slice(i * edges[0], (i + 1) * edges[0])
        columns = slice(j * edges[1], (j + 1) * edges[1])
        if not (allowed[0][rows].any() and allowed[1][columns].any()):
            wanted[i, j] = False
            continue
        middle = (
            (i * edges[0] + 0.5 * (edges[0] - 1)) * steps[0],
            (j * edges[1] + 0.5 * (edges[1] - 1)) * steps[1],
        )
        touching = surfaces.shapes_touch(*middle, TOUCHING + slack)
        if edge == 1 and not touching:
            continue
        found[i, j] = max(0.0, surfaces.distance(*middle, lost + FARTHEST) - ROUNDING)
        # Where shapes are apart, they decide.
        if edge == 1 or not touching or found[i, j] - lost >= ENOUGH:
            least = float(np.clip(found[i, j] - lost, 0.0, FARTHEST))
            corners[rows, columns] = math.floor(least / UNIT)
            wanted[i, j] = False
    if edge == 1:
        return wanted
    # Where all blocks around one are in contact too, nothing in it is free, up to slivers.
    meets = found == 0.0
    for axis in (0, 1):
        meets = meets & np.roll(meets, 1, axis) & np.roll(meets, -1, axis)
    return np.asarray(wanted & ~meets)


def _reachable(count: int, step: float, limits: tuple[float, float]) -> NDArray[np.bool_]:
    """Return which corners of a full turn are those of a cell with angles within limits [rad]."""
    low, high = limits
    if not high - low < 2.0 * math.pi:
        return np.ones(count, dtype=np.bool_)
    begin = np.arange(count) * step
    # The next angle at or above the lower limit that is in the cell.
    ahead = np.mod(low - begin, 2.0 * math.pi)
    cells = (ahead < step) | (np.mod(begin - low, 2.0 * math.pi) <= high - low)
    return np.asarray(cells | np.roll(cells, 1))
