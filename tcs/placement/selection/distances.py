"""How far it is to drive: in straight lines, or around the furniture.

Around the furniture means along `tcs.placement.tables.BaseLattice`, whose moves go to the eight
neighbours of a cell. In the open such a path is up to 8 percent longer than a straight line.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.tables import BaseLattice
from tcs.placement.tables.base_lattice import MOVES

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.integer[Any]]

ROUTES = ("straight", "around")
"""Names of the two."""

AT_ONCE = 64
"""Cells from which ways are found at once: their distances to all places are some megabytes."""


@dataclass(frozen=True, eq=False)
class Distances(abc.ABC):
    """Distances between the current place and base cells."""

    cell_xy: FloatArray
    """Places of the cells in W [m], shape (N, 2)."""

    @abc.abstractmethod
    def from_position(self, x: float, y: float) -> FloatArray:
        """Return how far it is from a place to each cell [m], inf where there is no way, (N,)."""

    @abc.abstractmethod
    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return how far it is between cells that have a way from one place [m], shape (...)."""


class StraightDistances(Distances):
    """Straight lines, whatever is in the way: the paper's choice."""

    def from_position(self, x: float, y: float) -> FloatArray:
        """Return the distance of each cell from a place [m], shape (N,)."""
        return _distance(np.array([x, y]), self.cell_xy)

    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return the distance of two cells [m], shape (...)."""
        return _distance(self.cell_xy[first], self.cell_xy[second])


@dataclass(frozen=True, eq=False)
class FloorDistances(Distances):
    """Shortest ways over the lattice. The first use finds those between all cells, and is slow."""

    lattice: BaseLattice
    """Where the base can drive."""

    def from_position(self, x: float, y: float) -> FloatArray:
        """Return how far it is from a place to each cell [m], inf where there is no way, (N,).

        Inside the lattice the robot first drives straight to a corner of the square it is in, if
        the base can move from there. Everything outside is free, and it drives straight to any
        place of the border that it can see.

        Raises:
            SelectionError: If the base cannot move from any corner of the square.
        """
        nodes, legs = self._entries(x, y)
        # The robot is one more node, after those of the lattice.
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import dijkstra

        graph = self._graph
        size = graph.shape[0]
        with_robot = csr_matrix(
            (
                np.concatenate([graph.data, legs]),
                np.concatenate([graph.indices, nodes.astype(graph.indices.dtype)]),
                np.concatenate([graph.indptr, [graph.nnz + nodes.size]]),
            ),
            shape=(size + 1, size + 1),
        )
        found: FloatArray = dijkstra(with_robot, indices=size)[self._node]
        return found

    def between(self, first: IntArray, second: IntArray) -> FloatArray:
        """Return how far it is between cells that have a way from one place [m], shape (...)."""
        return np.asarray(self._between[first, second])

    @cached_property
    def _node(self) -> IntArray:
        """Number of the lattice's place at each cell, shape (N,)."""
        along = np.rint((self.cell_xy - self.lattice.start) / self.lattice.step).astype(np.int64)
        return np.asarray(along[:, 0] * self.lattice.shape[1] + along[:, 1])

    @cached_property
    def _graph(self) -> Any:
        """The moves as a sparse matrix of lengths [m], both ways."""
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
        places = (np.concatenate(begin), np.concatenate(end))
        return csr_matrix((np.concatenate(length), places), shape=(number.size, number.size))

    @cached_property
    def _between(self) -> FloatArray:
        """How far it is between all cells [m], shape (N, N)."""
        from scipy.sparse.csgraph import dijkstra

        parts = [
            dijkstra(self._graph, indices=self._node[begin : begin + AT_ONCE])[:, self._node]
            for begin in range(0, self._node.size, AT_ONCE)
        ]
        found = np.concatenate(parts) if parts else np.zeros((0, 0))
        # Either way round the same steps are added in another order. Where there is no way
        # between two cells, none can be driven to from where the other can, and nobody asks.
        return np.nan_to_num(np.minimum(found, found.T), posinf=0.0)

    @cached_property
    def _movable(self) -> NDArray[np.bool_]:
        """Whether the base can move at all from a place, shape (X, Y)."""
        degree = np.diff(self._graph.indptr)
        return np.asarray(degree > 0).reshape(self.lattice.shape)

    def _entries(self, x: float, y: float) -> tuple[IntArray, FloatArray]:
        """Return the places the robot drives to first, and how far they are [m]."""
        (nx, ny), start, step = self.lattice.shape, np.array(self.lattice.start), self.lattice.step
        along = (np.array([x, y]) - start) / step
        if np.all((along >= 0.0) & (along <= (nx - 1, ny - 1))):
            i, j = np.minimum(np.floor(along).astype(np.int64), (nx - 2, ny - 2))
            square = np.array([[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]])
            entries = square[self._movable[square[:, 0], square[:, 1]]]
            if not len(entries):
                raise SelectionError(
                    f"Current state: the base at ({x:.2f}, {y:.2f}) m stands where the scores "
                    "leave it no room, so no way around the furniture starts there. Check the "
                    "place, or take straight lines."
                )
        else:
            i, j = np.indices((nx, ny))
            # From outside one sees the sides of the rectangle that one is beyond.
            seen = (
                ((i == 0) & (along[0] < 0.0))
                | ((i == nx - 1) & (along[0] > nx - 1))
                | ((j == 0) & (along[1] < 0.0))
                | ((j == ny - 1) & (along[1] > ny - 1))
            )
            entries = np.argwhere(seen)
        legs = _distance(np.array([x, y]), start + entries * np.array(step))
        return np.asarray(entries[:, 0] * ny + entries[:, 1]), legs


def _distance(p: FloatArray, q: FloatArray) -> FloatArray:
    """Return the straight distance of places, shapes (..., 2), as shape (...)."""
    dx, dy = q[..., 0] - p[..., 0], q[..., 1] - p[..., 1]
    return np.asarray(np.sqrt(dx * dx + dy * dy))
