"""Fraction of the sample loop's time that the measure takes, by compiling the loop without it."""

from __future__ import annotations

import ast
import inspect
import textwrap
import time
from collections.abc import Callable

import numba
import numpy as np
from peer_problems import Pair

from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.samples import solve_samples
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray

SAMPLES = 48
ROUNDS = 20
"""Passes over all goals in one timing, so that it takes milliseconds."""


def measure_fractions(arm: ArmSolver, pairs: tuple[Pair, ...], repeats: int) -> list[float]:
    """Return the fraction of the sample loop's time that the measure takes, once for each repeat.

    Empty if the loop does not store the measure in a way that can be taken out.
    """
    bare = samples_without_measure()
    if bare is None:
        return []
    goals = np.empty((len(pairs), 4, 3))
    for pair, goal in zip(pairs, goals, strict=True):
        wrist_goal(arm, pair.X_AG[:3, :3].copy(), pair.X_AG[:3, 3].copy(), goal)
    for function in (bare, solve_samples):
        _run(function, arm, goals, SAMPLES, 1)
    shares = []
    for _ in range(repeats):
        used = []
        for function in (bare, solve_samples):
            begun = time.process_time()
            _run(function, arm, goals, SAMPLES, ROUNDS)
            used.append(time.process_time() - begun)
        shares.append(1.0 - used[0] / used[1])
    return shares


def samples_without_measure() -> Callable[..., None] | None:
    """Return the loop over the samples compiled without storing the measure, None if it cannot be.

    The compiler then drops by itself all that only the measure needs.
    """
    function = solve_samples.py_func
    stripper = _Stripper()
    tree = stripper.visit(ast.parse(textwrap.dedent(inspect.getsource(function))))
    if not stripper.removed:
        return None
    tree.body[0].decorator_list = []
    names = dict(function.__globals__)
    exec(compile(ast.fix_missing_locations(tree), "samples without measure", "exec"), names)
    compiled: Callable[..., None] = numba.jit(**solve_samples.targetoptions)(
        names[function.__name__]
    )
    return compiled


class _Stripper(ast.NodeTransformer):
    """Takes out every `measure[...] = ...`."""

    def __init__(self) -> None:
        self.removed = 0

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        target = node.targets[0]
        stores = isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name)
        if stores and target.value.id == "measure":
            self.removed += 1
            return ast.Pass()
        return node


@numba.njit(nogil=True)
def _run(
    function: Callable[..., None], arm: ArmSolver, goals: FloatArray, samples: int, rounds: int
) -> None:
    """Solve samples spread over a full turn for every goal and branch."""
    cosines, sines = np.empty(samples), np.empty(samples)
    for i in range(samples):
        angle = 2.0 * np.pi * i / samples
        cosines[i], sines[i] = np.cos(angle), np.sin(angle)
    slack, measure = np.empty(samples), np.empty(samples)
    for _ in range(rounds):
        for k in range(len(goals)):
            for b in range(len(arm.branches)):
                function(arm, goals[k], arm.branches[b], cosines, sines, samples, slack, measure)
