"""Quicker answers to questions that numba's compiler asks itself thousands of times in a function.

Each answer is as before, so the code is too; together they took a third of numba's time in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba.core import event, ir, types
from numba.core.compiler import Flags
from numba.core.targetconfig import TargetConfig


@cache
def quicken_numba() -> None:
    """Make numba compile as before, in less time."""
    _quicken_flags()
    _keep_call_types()
    _quicken_variables()
    _time_outermost()


def _quicken_flags() -> None:
    """Compare and hash flags, by which numba keeps what it compiles, without all forty of them.

    They are left if this version of numba hashes the values of flags, not their names alone.
    """
    some, others = Flags(), Flags()
    # Options are descriptors, of which the types know nothing.
    others.nrt = not others.nrt  # type: ignore[misc, assignment]
    if hash(some) != hash(others) or some == others:
        return
    slow_hash, slow_equal = TargetConfig.__hash__, TargetConfig.__eq__
    hashes: dict[type, int] = {}

    def __hash__(self: TargetConfig) -> int:
        found = hashes.get(type(self))
        if found is None:
            found = hashes[type(self)] = slow_hash(self)
        return found

    def __eq__(self: TargetConfig, other: object) -> bool:
        if type(self) is type(other) and self._values == other._values:
            return True
        equal: bool = slow_equal(self, other)
        return equal

    methods: dict[str, Callable[..., object]] = {"__hash__": __hash__, "__eq__": __eq__}
    for name, method in methods.items():
        setattr(TargetConfig, name, method)


def _keep_call_types() -> None:
    """Find the signature of a call of a builtin function once for each type of its arguments.

    For `a + b`, numba tries the rules of arrays before those of numbers, in every line anew.
    """
    slow, kept = types.Function.get_call_type, "_kept_signatures"

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if kws:
            return slow(self, context, args, kws)
        # The function's own: with other rules it is another object.
        signatures = vars(self).setdefault(kept, {})
        if args not in signatures:
            signatures[args] = slow(self, context, args, kws)
        return signatures[args]

    types.Function.get_call_type = get_call_type  # type: ignore[method-assign]


def _quicken_variables() -> None:
    """List the variables of an instruction in one list, not in lists of lists."""

    def collect(value: object, found: list[Any]) -> None:
        if isinstance(value, ir.Var):
            found.append(value)
        elif isinstance(value, ir.Inst):
            found.extend(value.list_vars())
        elif isinstance(value, (list, tuple)):
            for member in value:
                collect(member, found)
        elif isinstance(value, dict):
            for member in value.values():
                collect(member, found)

    def list_vars(_self: Any, value: object) -> list[Any]:
        found: list[Any] = []
        collect(value, found)
        return found

    ir.Inst._rec_list_vars = list_vars  # type: ignore[method-assign]


def _time_outermost() -> None:
    """Time the outermost of functions that are compiled within each other: it holds the others.

    Otherwise every lock tells the timers of all functions further out.
    """
    install, running = event.install_timer, set[str]()

    @contextmanager
    def install_timer(kind: str, callback: Callable[[float], None]) -> Iterator[Any]:
        if kind in running:
            yield None
            return
        running.add(kind)
        try:
            with install(kind, callback) as timer:
                yield timer
        finally:
            running.discard(kind)

    event.install_timer = install_timer
