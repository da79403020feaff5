"""Contacts of an arm that moves in small steps: distant pairs of shapes are left out for a while.

Drake's own search for close pairs tests every shape of the scene at every posture, moving or not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import BodyIndex

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.model.scene.contacts import Group, Part, shape_of
from tcs.model.scene.scene import Contact, Scene, least_distances

SKIN = 0.04
"""Motion of any point of the arm after which close pairs are sought again [m]. Less means fewer
pairs at each posture, but more searches."""
ROUNDING = 1e-6
"""Added to required distances when pairs are left out [m]: poses round, and far less."""
CLUSTER = 16
"""Most shapes of a cluster: half a million pairs of shapes are some thousand pairs of clusters."""


class NeighbourList:
    """The checked pairs of shapes of a scene that may touch before the arm has moved by `SKIN`.

    A pair is left out only while a bound shows that it cannot come closer than required: the
    distance of boxes that enclose its shapes, along their axes, when close pairs were last sought,
    less the motion of both bodies since, or of one as seen from the other, from Drake's poses. All
    pairs of two clusters, shapes of a body that lie together, are left out by the boxes around the
    clusters. Drake measures all other pairs at every posture. If more than the arm has moved, close
    pairs are sought again.
    """

    def __init__(self, scene: Scene) -> None:
        """Read the shapes and the checked pairs of a scene, which keeps its state."""
        self.scene = scene
        parts = scene.built.parts
        bodies = sorted({int(part.body) for part in parts})
        number = {body: row for row, body in enumerate(bodies)}
        self._bodies = [scene.built.plant.get_body(BodyIndex(body)) for body in bodies]
        self._body = np.array([number[int(part.body)] for part in parts])
        self._boxes = _Boxes.of(scene, parts)
        arm = {number[int(part.body)] for part in parts if part.group is Group.ARM}
        self._arm = np.array(sorted(arm))
        self._radius = np.zeros(len(bodies))
        np.maximum.at(self._radius, self._body, self._boxes.reach)
        cluster = _clusters(self._body, self._boxes.X_BG[:, :, 3])
        self._around = self._boxes.around(cluster)
        self._body_of_cluster = np.zeros(cluster.max() + 1, dtype=np.intp)
        self._body_of_cluster[cluster] = self._body
        self._pairs, self._required = _checked_pairs(scene, parts, cluster)
        self._clusters, self._first = np.unique(cluster[self._pairs], axis=0, return_index=True)
        self._of_clusters = np.maximum.reduceat(self._required, self._first)
        self._near = np.zeros(0, dtype=np.intp)
        self._bound = np.zeros(0)
        self._near_bodies = np.zeros((0, 2), dtype=np.intp)
        self._near_bodies_of = np.zeros(0, dtype=np.intp)
        self._sought_apart = np.zeros((0, 3, 4))
        self._sought: FloatArray | None = None
        self._others = scene.positions_without_arm()

    def violations(self) -> tuple[Contact, ...]:
        """Return the same as `Scene.violations` at the current state of the scene."""
        rows, nearer = self._near, self._nearer()
        if nearer is None:
            rows, nearer = self._seek(), np.zeros(1)
        close = rows[self._bound < self._required[rows] + nearer + ROUNDING]
        if not len(close):
            return ()
        query, parts = self.scene.query_object(), self.scene.built.parts
        found = []
        for row in close:
            a, b = (parts[i] for i in self._pairs[row])
            pair = query.ComputeSignedDistancePairClosestPoints(a.geometry, b.geometry)
            if pair.distance < self._required[row]:
                found.append((a, b, pair.distance))
        return tuple(
            contact
            for contact in self.scene.by_surfaces(least_distances(found))
            if contact[2] < self.scene.required_clearance(contact[0], contact[1])
        )

    def _nearer(self) -> FloatArray | None:
        """Return by how much near pairs may have come nearer since they were sought [m].

        None if the arm has moved by more than `SKIN`, or anything else, or they were never sought.
        """
        others = self.scene.positions_without_arm()
        if self._sought is None or not np.array_equal(others, self._others):
            return None
        arm, X_WB = self._arm, self._sought.copy()
        X_WB[arm] = self._poses(arm)
        moved = np.zeros(len(self._bodies))
        moved[arm] = _motion(self._sought[arm], X_WB[arm], self._radius[arm])
        if moved.max() > SKIN:
            return None
        first, second = self._near_bodies.T
        X_AB = _relative(X_WB[first], X_WB[second])
        apart = _motion(self._sought_apart, X_AB, self._radius[second])
        return np.asarray(np.minimum(moved[first] + moved[second], apart)[self._near_bodies_of])

    def _seek(self) -> NDArray[np.intp]:
        """Seek and return the numbers of the pairs that may touch within `SKIN`."""
        self._others = self.scene.positions_without_arm()
        self._sought = X_WB = self._poses(np.arange(len(self._bodies)))
        skin = 2.0 * SKIN + ROUNDING
        clusters, _ = self._around.near(
            X_WB[self._body_of_cluster], self._clusters, self._of_clusters + skin
        )
        ends = np.append(self._first[1:], len(self._pairs))
        ranges = [np.arange(self._first[i], ends[i]) for i in clusters]
        rows = np.concatenate([np.zeros(0, dtype=np.intp), *ranges])
        near, self._bound = self._boxes.near(
            X_WB[self._body], self._pairs[rows], self._required[rows] + skin
        )
        self._near = rows[near]
        bodies = self._body[self._pairs[self._near]]
        # A body seen from another moves by its radius where it turns: that of the smaller one.
        swapped = self._radius[bodies[:, 0]] < self._radius[bodies[:, 1]]
        bodies[swapped] = bodies[swapped, ::-1]
        self._near_bodies, of = np.unique(bodies, axis=0, return_inverse=True)
        self._near_bodies_of = of.reshape(-1)
        first, second = self._near_bodies.T
        self._sought_apart = _relative(X_WB[first], X_WB[second])
        return self._near

    def _poses(self, bodies: NDArray[np.intp]) -> FloatArray:
        """Return the poses of bodies in W: rotations and positions [m], shape (n, 3, 4)."""
        plant, context = self.scene.built.plant, self.scene.plant_context
        return np.array(
            [plant.EvalBodyPoseInWorld(context, self._bodies[i]).GetAsMatrix34() for i in bodies]
        )


def _motion(before: FloatArray, now: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how far any point of each body may have moved between two poses [m], shape (n,).

    Args:
        before: Poses, shape (n, 3, 4).
        now: Poses, shape (n, 3, 4).
        radius: Greatest distance of a point from the origin of its body [m], shape (n,).
    """
    change = now - before
    # The spectral norm of the difference of two rotations is their Frobenius norm / sqrt(2).
    rotated = np.linalg.norm(change[:, :, :3], axis=(1, 2)) / np.sqrt(2.0)
    return np.asarray(np.linalg.norm(change[:, :, 3], axis=1) + rotated * radius)


def _relative(X_WA: FloatArray, X_WB: FloatArray) -> FloatArray:
    """Return X_AB of poses in W, shape (n, 3, 4)."""
    R_AW = X_WA[:, :, :3].transpose(0, 2, 1)
    offset = X_WB.copy()
    offset[:, :, 3] -= X_WA[:, :, 3]
    return np.asarray(R_AW @ offset)


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Boxes that enclose the shapes, in the frames of their bodies."""

    X_BG: FloatArray
    """Rotations and centres [m], shape (n, 3, 4)."""
    half: FloatArray
    """Half lengths of the edges [m], shape (n, 3)."""

    @classmethod
    def of(cls, scene: Scene, parts: tuple[Part, ...]) -> _Boxes:
        """Enclose the shapes of a scene."""
        inspector = scene.built.scene_graph.model_inspector()
        half, poses = [], []
        for part in parts:
            poses.append(inspector.GetPoseInFrame(part.geometry).GetAsMatrix34())
            type_, size = shape_of(inspector, part)
            if type_ == BOX:
                half.append(size)
            else:
                radius, length = size[0], size[1] if type_ == CAPSULE else 0.0
                half.append((radius, radius, radius + length))
        return cls(np.array(poses), np.array(half))

    def around(self, number: NDArray[np.intp]) -> _Boxes:
        """Return boxes along the axes of the body around the boxes of each number, 0 and up."""
        count = number.max() + 1
        extent = np.einsum("nij,nj->ni", np.abs(self.X_BG[:, :, :3]), self.half)
        lower, upper = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        np.minimum.at(lower, number, self.X_BG[:, :, 3] - extent)
        np.maximum.at(upper, number, self.X_BG[:, :, 3] + extent)
        X_BC = np.zeros((count, 3, 4))
        X_BC[:, :, :3], X_BC[:, :, 3] = np.eye(3), 0.5 * (lower + upper)
        return _Boxes(X_BC, 0.5 * (upper - lower))

    @property
    def reach(self) -> FloatArray:
        """Greatest distance of a point of each box from the origin of its body [m], shape (n,)."""
        centre = np.linalg.norm(self.X_BG[:, :, 3], axis=1)
        return np.asarray(centre + np.linalg.norm(self.half, axis=1))

    def near(
        self, X_WB: FloatArray, pairs: NDArray[np.intp], limits: FloatArray
    ) -> tuple[NDArray[np.intp], FloatArray]:
        """Return the numbers of pairs that may be closer than their limits, with lower bounds [m].

        Args:
            X_WB: Pose of the body of each shape, shape (n, 3, 4).
            pairs: Numbers of two shapes, shape (m, 2).
            limits: Distances [m], shape (m,).
        """
        R = X_WB[:, :, :3] @ self.X_BG[:, :, :3]
        p = np.einsum("nij,nj->ni", X_WB[:, :, :3], self.X_BG[:, :, 3]) + X_WB[:, :, 3]
        radius = np.linalg.norm(self.half, axis=1)
        a, b = pairs.T
        apart = np.linalg.norm(p[b] - p[a], axis=1) - radius[a] - radius[b]
        rows = np.flatnonzero(apart < limits)
        a, b = pairs[rows].T
        offset, R_ab = p[b] - p[a], np.einsum("nji,njk->nik", R[a], R[b])
        extent = np.abs(R_ab)
        along_a = np.abs(np.einsum("nji,nj->ni", R[a], offset)) - self.half[a]
        along_a -= np.einsum("nij,nj->ni", extent, self.half[b])
        along_b = np.abs(np.einsum("nji,nj->ni", R[b], offset)) - self.half[b]
        along_b -= np.einsum("nij,ni->nj", extent, self.half[a])
        bound = np.maximum(along_a.max(axis=1), along_b.max(axis=1))
        bound = np.maximum(bound, apart[rows])
        closer = bound < limits[rows]
        return rows[closer], bound[closer]


def _clusters(body: NDArray[np.intp], centres: FloatArray) -> NDArray[np.intp]:
    """Return the number of the cluster of each shape, shape (n,).

    Args:
        body: Number of the body of each shape, shape (n,).
        centres: Centres of the shapes in their bodies [m], shape (n, 3).
    """
    number = np.zeros(len(body), dtype=np.intp)
    count, left = 0, [np.flatnonzero(body == one) for one in np.unique(body)]
    while left:
        rows = left.pop()
        if len(rows) <= CLUSTER:
            number[rows] = count
            count += 1
            continue
        axis = np.argmax(np.ptp(centres[rows], axis=0))
        rows = rows[np.argsort(centres[rows, axis], kind="stable")]
        left += [rows[: len(rows) // 2], rows[len(rows) // 2 :]]
    return number


def _checked_pairs(
    scene: Scene, parts: tuple[Part, ...], cluster: NDArray[np.intp]
) -> tuple[NDArray[np.intp], FloatArray]:
    """Return two numbers of shapes, shape (m, 2), and the required distance [m] of each pair.

    The pairs are in the order of their clusters.
    """
    # The pairs that Drake checks: it would list them one by one, hundreds of thousands.
    pairs = np.argwhere(np.triu(scene.built.rule.checked(list(parts), list(parts)), 1))
    pairs = pairs[np.lexsort(cluster[pairs].T[::-1])]
    names = sorted({part.name for part in parts})
    required = np.array([[scene.required_clearance(a, b) for b in names] for a in names])
    name = np.array([names.index(part.name) for part in parts])
    return pairs, required[name[pairs[:, 0]], name[pairs[:, 1]]]
