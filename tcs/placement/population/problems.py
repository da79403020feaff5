"""The kernel's problem with another person in it: what depends on the person is arranged anew."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, SceneArrays
from tcs.kernel.groups import with_group_rows
from tcs.kernel.problem import (
    TOUCH,
    UNCHECKED,
    Problem,
    arm_order,
    build_problem,
    with_environment,
)


class PersonProblems:
    """Problems of one robot in one environment, for one person after the other.

    Arranging the robot takes a hundred times as long as what a person changes.
    """

    def __init__(self, arrays: SceneArrays, measure: str) -> None:
        """Arrange the robot.

        Args:
            arrays: The scene with any person.
            measure: Name of the dexterity measure.
        """
        self._problem = problem = build_problem(arrays, measure)
        order = arm_order(arrays)
        self._pads = arrays.arm.pad[order], arrays.body.pad
        self._checked = arrays.arm_vs_environment[order], arrays.body_vs_environment
        self._groups = problem.links.groups, problem.body.groups
        self._margin = arrays.margin

    def of(self, arrays: SceneArrays) -> Problem:
        """Return the problem of a person.

        Args:
            arrays: The same scene with the person; only its environment and goals are read.
        """
        known, pad = self._problem.clearances, arrays.environment.pad
        widest = max(known.widest, 2.0 * float(pad.max(initial=0.0)))
        clearances = known._replace(
            environment=self._gaps(0, pad),
            base=self._gaps(1, pad),
            widest=widest,
            arm_radius=known.arm_radius + (widest - known.widest),
        )
        return with_environment(self._problem, arrays)._replace(clearances=clearances)

    def _gaps(self, group: int, pad: FloatArray) -> FloatArray:
        """Return the distances that arm (0) or body (1) keep from the environment [m]."""
        required = np.maximum(max(self._margin, TOUCH), self._pads[group][:, None] + pad)
        gaps = np.where(self._checked[group], required, UNCHECKED)
        return with_group_rows(np.ascontiguousarray(gaps), self._groups[group])
