"""The start of the kernel: its machine code, compiled or loaded when scores are first needed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import nullcontext
from dataclasses import dataclass, field

from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.cache import announced
from tcs.kernel.problem import Problem
from tcs.kernel.quick_numba import quicken_numba
from tcs.kernel.rows import no_rows
from tcs.kernel.sweep import score
from tcs.placement.scoring.approaches import ApproachScorer

ANALYTIC, NUMERIC = "analytic", "numeric"
"""Solution of the inverse kinematics: in closed form, or by Newton's method from many starts."""


@dataclass(eq=False, slots=True)
class KernelStart:
    """The start of the kernel for some problems, which a run that takes all from blocks saves."""

    problems: Callable[[], Iterable[Problem]]
    """Returns problems whose scoring needs all the machine code."""
    on_compile: Callable[[], None] | None = None
    """Called first if the kernel has to be compiled."""
    approaches: ApproachScorer | None = None
    """Who will score approaches."""
    seconds: float = 0.0
    """Time that this has taken [s]."""
    is_done: bool = field(default=False, init=False)

    def ensure(self) -> None:
        """Compile the kernel or load its machine code, unless that was done.

        Raises:
            MemoryError: If the address space is limited, and too little is left.
        """
        if not self.is_done:
            self.seconds = sum(
                warm_up(problem, self.on_compile, self.approaches) for problem in self.problems()
            )
            self.is_done = True


def ik_of(problem: Problem) -> str:
    """Return the inverse kinematics of the problem's arm: ANALYTIC or NUMERIC."""
    return NUMERIC if problem.chain.joints == 7 and is_outside(problem.arm) else ANALYTIC


def warm_up(
    problem: Problem,
    on_compile: Callable[[], None] | None = None,
    approaches: ApproachScorer | None = None,
) -> float:
    """Compile the kernel or load its machine code; return the time this took [s].

    Raises:
        MemoryError: If the address space is limited, and too little is left.
    """
    begun = time.perf_counter()
    quicken_numba()
    with announced(on_compile):
        with nullcontext() if approaches is None else approaches.compiled_beside():
            score(problem, no_rows())
        if approaches is not None:
            approaches.warm_up()
    return time.perf_counter() - begun
