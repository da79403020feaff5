"""Recorder of a session: collects commands and steps as a run, an hour at 100 Hz in 120 MB."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from tcs.teleop import Arm, Command, Step
from tcs.teleop.runs.run import NO_GROUP, Run

_BLOCK = 6000
"""Number of steps after which objects are converted to arrays: a minute at 100 Hz."""
_LEAST = 2
"""Least number of samples of a run."""
_PUT_BACK = 1e-4
"""Difference of joints from the integral of their rates [rad] above which they were set."""


class Recorder:
    """Collector of commands and steps."""

    def __init__(self, arm: Arm) -> None:
        """Create an empty recorder.

        Args:
            arm: The arm.
        """
        self._arm = arm
        self._blocks: list[Run] = []
        self._rows: list[tuple[Command, Step]] = []

    def __len__(self) -> int:
        return sum(len(block) for block in self._blocks) + len(self._rows)

    def add(self, command: Command, step: Step) -> None:
        """Record a command and the step that followed."""
        self._rows.append((command, step))
        if len(self._rows) >= _BLOCK + _LEAST:
            self._blocks.append(run_from_steps(self._arm, self._rows[:_BLOCK], {}))
            self._rows = self._rows[_BLOCK:]

    def run(self, metadata: Mapping[str, Any]) -> Run | None:
        """Return the recorded run; None if there are fewer than two samples.

        Args:
            metadata: Metadata of the run.
        """
        if len(self) < _LEAST:
            return None
        blocks = [*self._blocks, run_from_steps(self._arm, self._rows, {})]
        arrays = {
            one.name: np.concatenate([getattr(block, one.name) for block in blocks])
            for one in dataclasses.fields(Run)
            if one.name not in ("joint_names", "metadata")
        }
        return Run(self._arm.joints, **arrays, metadata=metadata)


def last_attempt(run: Run) -> int:
    """Return the index of the first sample of the operator's last attempt at a line.

    An attempt begins with the first command after the arm was put back to its start posture;
    without a command the result is the last sample.
    """
    steps = np.diff(run.joints, axis=0) - run.rates[1:] * np.diff(run.time)[:, None]
    # Joints are the integral of the rates, within the digits of a file, unless they were set.
    put_back = np.flatnonzero(np.abs(steps).max(axis=1) > _PUT_BACK)
    first = int(put_back[-1]) + 1 if len(put_back) else 0
    commanded = run.linear.any(axis=1) | run.angular.any(axis=1) | (run.sign != 0)
    after = np.flatnonzero(commanded[first:])
    return first + int(after[0]) if len(after) else len(run) - 1


def run_from_steps(arm: Arm, rows: list[tuple[Command, Step]], metadata: Mapping[str, Any]) -> Run:
    """Return commands and steps as a run.

    Args:
        arm: The arm.
        rows: At least two pairs of a command and the step after it.
        metadata: Metadata of the run.
    """
    from scipy.spatial.transform import Rotation

    commands, steps = [row[0] for row in rows], [row[1] for row in rows]

    def column(values: list[Any], dtype: Any = np.float64) -> Any:
        return np.array(values, dtype=dtype)

    return Run(
        joint_names=tuple(arm.joints),
        time=column([step.time for step in steps]),
        joints=column([step.joints for step in steps]),
        rates=column([step.rates for step in steps]),
        position=column([step.p for step in steps]),
        quaternion=Rotation.from_matrix([step.R for step in steps]).as_quat(scalar_first=True),
        linear=column([command.linear for command in commands]),
        angular=column([command.angular for command in commands]),
        group=column([_group(command) for command in commands], np.int64),
        sign=column([command.sign for command in commands], np.int64),
        clutch=column([command.clutch for command in commands], np.bool_),
        mode=np.array([step.mode.value for step in steps]),
        limits=column([step.limits for step in steps], np.int64),
        singular=column([step.singular for step in steps], np.bool_),
        stopped=column([step.stopped for step in steps], np.bool_),
        metadata=metadata,
    )


def _group(command: Command) -> int:
    return NO_GROUP if command.group is None else command.group
