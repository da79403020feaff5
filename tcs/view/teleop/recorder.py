"""What is driven, kept in little room: an hour at 100 Hz in some 120 MB."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from tcs.teleop import Arm, Command, Step
from tcs.teleop.run import Run
from tcs.teleop.trial import run_of

_BLOCK = 6000
"""Steps after which single ones become arrays: a minute's."""
_LEAST = 2
"""Samples that a run must have."""


class Recorder:
    """Commands and steps on their way to a run."""

    def __init__(self, arm: Arm) -> None:
        """Begin with nothing.

        Args:
            arm: The arm that is driven.
        """
        self._arm = arm
        self._blocks: list[Run] = []
        self._rows: list[tuple[Command, Step]] = []

    def __len__(self) -> int:
        return sum(len(block) for block in self._blocks) + len(self._rows)

    def add(self, command: Command, step: Step) -> None:
        """Keep a step, and the command that it followed."""
        self._rows.append((command, step))
        if len(self._rows) >= _BLOCK + _LEAST:
            self._blocks.append(run_of(self._arm, self._rows[:_BLOCK], {}))
            self._rows = self._rows[_BLOCK:]

    def run(self, metadata: Mapping[str, Any]) -> Run | None:
        """Return all of it as a run; None if it is too short for one.

        Args:
            metadata: What the run is to say about itself.
        """
        if len(self) < _LEAST:
            return None
        blocks = [*self._blocks, run_of(self._arm, self._rows, {})]
        arrays = {
            one.name: np.concatenate([getattr(block, one.name) for block in blocks])
            for one in dataclasses.fields(Run)
            if one.name not in ("joint_names", "metadata")
        }
        return Run(self._arm.joints, **arrays, metadata=metadata)
