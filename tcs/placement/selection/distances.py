"""Driving distances between base cells: along straight lines, or around the furniture.

Distances around the furniture are shortest paths over `tcs.placement.tables.BaseLattice`, whose
moves lead to the eight neighbours of a lattice position. On free floor such a path is up to 8
percent longer than the straight line.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.tables import BaseLattice
from tcs.placement.tables.sets import MOVES

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.integer[Any]]

ROUTES = ("straight", "around")
"""Names of the two routes."""

PREFERENCE = 1e-9
"""Relative excess of moves outside a rectangle: decides between equally short paths only."""

ON_EDGE = 1e-6
"""Tolerance [m] of a lattice position on the edge of a rectangle."""

NO_NODE = -9999
"""What scipy enters as the node before the first one of a path."""

CHUNK = 64
"""Cells whose shortest paths are computed in one call: their distances take some megabytes."""


@dataclass(frozen=True, eq=False)
class Distances(abc.ABC):
    """Driving distances from the current position to base cells, and between cells."""

    cell_xy: FloatArray
    """Positions of the cells in W [m], shape (N, 2)."""

    @abc.abstractmethod
    def from_position(self, x: float, y: float) -> FloatArray:
        """Return the distance of each cell from a position [m], shape (N,).

        Infinite where no path leads.
        """

    @abc.abstractmethod
    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return the distance between cells that one position can reach [m], shape (...)."""


class StraightDistances(Distances):
    """Straight-line distances that ignore obstacles: the paper's choice."""

    def from_position(self, x: float, y: float) -> FloatArray:
        """Return the distance of each cell from a position [m], shape (N,)."""
        return _distance(np.array([x, y]), self.cell_xy)

    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return the distance between two cells [m], shape (...)."""
        return _distance(self.cell_xy[first], self.cell_xy[second])


@dataclass(frozen=True, eq=False)
class LatticeDistances(Distances):
    """Lengths of shortest paths over the lattice.

    The paths between all cells are computed on first use; keep the object for repeated selection.
    """

    lattice: BaseLattice
    """Where the base can drive."""
    origin: IntArray | None = None
    """Cell through which the path to each cell leads, and straight on from there, shape (N,); None
    if all are positions of the lattice."""

    def from_position(self, x: float, y: float) -> FloatArray:
        """Return the distance of each cell from a position [m], shape (N,).

        Inside the lattice the robot first drives straight to a corner of the square it is in from
        which the base can move. Outside the lattice the floor is free, and it drives straight to
        any border position in line of sight.

        Returns:
            Distances, infinite where no path leads.

        Raises:
            SelectionError: If the base cannot move from any corner of the square.
        """
        from scipy.sparse.csgraph import dijkstra

        graph = _with_robot(self._graph, *self._entries(x, y))
        found: FloatArray = dijkstra(graph, indices=graph.shape[0] - 1)[self._node]
        return found + self._offset

    def path(
        self, x: float, y: float, cells: Sequence[int], low: FloatArray, high: FloatArray
    ) -> FloatArray:
        """Return the corners of a shortest path from a position through cells, in this order.

        Among equally short paths, one is returned that stays within a rectangle if possible.

        Args:
            x: x of the position in W [m], from which the cells are reachable.
            y: Its y [m].
            cells: The cells to visit.
            low: Least x and y of the rectangle [m], shape (2,).
            high: Greatest x and y of the rectangle [m], shape (2,).

        Returns:
            Positions in W [m], shape (n, 2); the first is that of the robot.
        """
        from scipy.sparse.csgraph import dijkstra

        position = self.lattice.start + np.indices(self.lattice.shape).reshape(2, -1).T * np.array(
            self.lattice.step
        )
        outside = np.any((position < low - ON_EDGE) | (position > high + ON_EDGE), axis=1)
        graph = self._graph.copy()
        begin = np.repeat(np.arange(graph.shape[0]), np.diff(graph.indptr))
        graph.data *= 1.0 + PREFERENCE * (outside[begin] | outside[graph.indices])
        nodes, legs = self._entries(x, y)
        graph = _with_robot(graph, nodes, legs * (1.0 + PREFERENCE * outside[nodes]))
        corners = [np.array([[x, y]])]
        source = graph.shape[0] - 1
        for target in self._node[list(cells)]:
            before = dijkstra(graph, indices=source, return_predecessors=True)[1]
            reverse = [int(target)]
            while before[reverse[-1]] not in (source, NO_NODE):
                reverse.append(int(before[reverse[-1]]))
            corners.append(position[reverse[::-1]])
            source = int(target)
        return np.concatenate(corners)

    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return the distance between cells that one position can reach [m], shape (...)."""
        return np.asarray(self._between[first, second])

    @cached_property
    def _node(self) -> IntArray:
        """Lattice node of each cell, shape (N,)."""
        along = np.rint((self._on_lattice - self.lattice.start) / self.lattice.step)
        along = along.astype(np.int64)
        return np.asarray(along[:, 0] * self.lattice.shape[1] + along[:, 1])

    @property
    def _on_lattice(self) -> FloatArray:
        """Lattice position from which each cell is reached [m], shape (N, 2)."""
        return self.cell_xy if self.origin is None else self.cell_xy[self.origin]

    @cached_property
    def _offset(self) -> FloatArray:
        """Distance of each cell from that position [m], shape (N,)."""
        return _distance(self._on_lattice, self.cell_xy)

    @cached_property
    def _graph(self) -> Any:
        """The moves in both directions as a sparse matrix of lengths [m]."""
        from scipy.sparse import csr_matrix

        number = np.arange(self.lattice.moves[0].size)
        begin, end, length = [], [], []
        for along, (dx, dy) in zip(self.lattice.moves, MOVES, strict=True):
            there = number[along.ravel()]
            back = there + dx * self.lattice.shape[1] + dy
            begin += [there, back]
            end += [back, there]
            one = np.hypot(dx * self.lattice.step[0], dy * self.lattice.step[1])
            length.append(np.full(2 * there.size, one))
        positions = (np.concatenate(begin), np.concatenate(end))
        return csr_matrix((np.concatenate(length), positions), shape=(number.size, number.size))

    @cached_property
    def _between(self) -> FloatArray:
        """Distances between all cells [m], shape (N, N)."""
        from scipy.sparse.csgraph import dijkstra

        parts = [
            dijkstra(self._graph, indices=self._node[begin : begin + CHUNK])[:, self._node]
            for begin in range(0, self._node.size, CHUNK)
        ]
        found = np.concatenate(parts) if parts else np.zeros((0, 0))
        # The two directions add the same steps in another order. Two cells without a path between
        # them are never reachable from one position, so their entry is never read.
        shortest = np.nan_to_num(np.minimum(found, found.T), posinf=0.0)
        return np.asarray(shortest + self._offset[:, None] + self._offset)

    @cached_property
    def _movable(self) -> NDArray[np.bool_]:
        """Whether the base can move away from a lattice position, shape (X, Y)."""
        degree = np.diff(self._graph.indptr)
        return np.asarray(degree > 0).reshape(self.lattice.shape)

    def _entries(self, x: float, y: float) -> tuple[IntArray, FloatArray]:
        """Return the lattice nodes the robot can drive to first, and their distances [m]."""
        (nx, ny), start, step = self.lattice.shape, np.array(self.lattice.start), self.lattice.step
        along = (np.array([x, y]) - start) / step
        if np.all((along >= 0.0) & (along <= (nx - 1, ny - 1))):
            i, j = np.minimum(np.floor(along).astype(np.int64), (nx - 2, ny - 2))
            square = np.array([[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]])
            entries = square[self._movable[square[:, 0], square[:, 1]]]
            if not len(entries):
                raise SelectionError(
                    f"Current state: by the scores, the base is in collision at ({x:.2f}, {y:.2f}) "
                    "m, or a constraint excluded the position, so no path around the furniture "
                    "starts there. Check the position, or use straight lines."
                )
        else:
            i, j = np.indices((nx, ny))
            # From outside, the sides of the rectangle that face the robot are in line of sight.
            visible = (
                ((i == 0) & (along[0] < 0.0))
                | ((i == nx - 1) & (along[0] > nx - 1))
                | ((j == 0) & (along[1] < 0.0))
                | ((j == ny - 1) & (along[1] > ny - 1))
            )
            entries = np.argwhere(visible)
        legs = _distance(np.array([x, y]), start + entries * np.array(step))
        return np.asarray(entries[:, 0] * ny + entries[:, 1]), legs


def _distance(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the Euclidean distance of positions of shapes (..., 2), shape (...)."""
    dx, dy = q[..., 0] - p[..., 0], q[..., 1] - p[..., 1]
    return np.asarray(np.sqrt(dx * dx + dy * dy))


def _with_robot(graph: Any, nodes: IntArray, legs: FloatArray) -> Any:
    """Return a graph with the robot as its last node, joined to some nodes by legs [m]."""
    from scipy.sparse import csr_matrix

    size = graph.shape[0]
    return csr_matrix(
        (
            np.concatenate([graph.data, legs]),
            np.concatenate([graph.indices, nodes.astype(graph.indices.dtype)]),
            np.concatenate([graph.indptr, [graph.nnz + nodes.size]]),
        ),
        shape=(size + 1, size + 1),
    )
