"""Fixed poses in moving frames, composed for many states of a scene at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydrake.geometry import SceneGraphInspector
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.framework import Context

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.model.scene.contacts import Part


@dataclass(frozen=True, eq=False)
class AttachedPoses:
    """Poses X_FG that are fixed in frames F of Drake's plant.

    Drake computes a pose for each frame and state; those attached to it follow by one product.
    """

    frames: tuple[Frame, ...]
    """The frames, each once."""
    row: IntArray
    """Frame of each pose, shape (n,)."""
    X_FG: FloatArray
    """Shape (n, 3, 4)."""

    @classmethod
    def of(cls, attached: Sequence[tuple[Frame, RigidTransform]]) -> Self:
        """Return poses, given the frame and the pose in it of each."""
        frames = {frame.index(): frame for frame, _ in attached}
        order = list(frames)
        matrices = [X_FG.GetAsMatrix34() for _, X_FG in attached]
        return cls(
            tuple(frames.values()),
            np.array([order.index(frame.index()) for frame, _ in attached], dtype=np.int64),
            np.array(matrices, dtype=np.float64).reshape(len(matrices), 3, 4),
        )

    @classmethod
    def of_parts(
        cls, plant: MultibodyPlant, inspector: SceneGraphInspector, parts: Sequence[Part]
    ) -> Self:
        """Return the poses of shapes in their bodies."""
        attached = []
        for part in parts:
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(part.geometry))
            attached.append((body.body_frame(), inspector.GetPoseInFrame(part.geometry)))
        return cls.of(attached)

    def frames_in_world(self, context: Context) -> FloatArray:
        """Return X_WF at the present state, shape (frames, 3, 4)."""
        poses = [frame.CalcPoseInWorld(context).GetAsMatrix34() for frame in self.frames]
        return np.array(poses, dtype=np.float64).reshape(len(self.frames), 3, 4)

    def at(self, X_WF: FloatArray) -> FloatArray:
        """Return X_WG for poses of the frames, shapes (states, frames, 3, 4), (states, n, 3, 4)."""
        R_WF, p_WF = X_WF[:, self.row, :, :3], X_WF[:, self.row, :, 3:]
        return np.concatenate(
            [R_WF @ self.X_FG[:, :, :3], R_WF @ self.X_FG[:, :, 3:] + p_WF], axis=-1
        )
