"""Goals that configurations off the grid reach in perturbed environments."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import BoolArray
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import torso_at
from tcs.placement.refinement.points import Points
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.robustness.perturbed_scenes import BATCH, BasePoses, Run
from tcs.placement.robustness.trials import Trials, displaced, samples_of


@dataclass(frozen=True, eq=False)
class PerturbedPoints:
    """The same samples of the error model for every configuration (common random numbers)."""

    trials: Trials
    """The table of the score file, prepared for trials."""
    offsets: Offsets
    """Errors of the joints, shapes (samples,)."""
    jobs: int
    """Number of threads; the result does not depend on it."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return samples_of(self.offsets)

    def reached(self, points: Points) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        fixed = points.values.shape[1] - len(ROBOT_AXES)
        out = np.zeros((len(points.values), self.samples, self.trials.weights.size), dtype=np.bool_)
        states = np.column_stack([points.arm, points.values[:, :fixed]])
        for state in np.unique(states, axis=0):
            self._fill(points, np.flatnonzero(np.all(states == state, axis=1)), out)
        return out

    def _fill(
        self, points: Points, rows: np.ndarray[tuple[int], np.dtype[np.intp]], out: BoolArray
    ) -> None:
        """Fill the rows of configurations with one arm and one state of the environment."""
        trials = self.trials
        arm = trials.arms[int(points.arm[rows[0]])]
        values = points.values[rows]
        axes = trials.grid.environment_axes
        nominal = {
            **trials.observed,
            **{axis.name: float(values[0, i]) for i, axis in enumerate(axes)},
        }
        positions, _ = displaced(arm.job, arm.scene, nominal, self.offsets)
        x, y, yaw, torso = (np.ascontiguousarray(c) for c in values[:, -len(ROBOT_AXES) :].T)
        levels, level = np.unique(torso, return_inverse=True)
        raised = dataclasses.replace(arm.lowered, arrays=torso_at(arm.lowered, arm.scene, levels))
        scenes = arm.scenes(positions, raised, str(trials.file.metadata["measure"]))
        poses = BasePoses(np.zeros(rows.size, dtype=np.int64), x, y, yaw, level)
        runs = [
            Run(row, start, min(start + BATCH, self.samples))
            for row in range(rows.size)
            for start in range(0, self.samples, BATCH)
        ]
        for run, found in scenes.reached(poses, runs, self.jobs):
            out[rows[run.row], run.start : run.stop] = found
