"""Quicker comparison of numba's compiler flags, of which it asks ten thousand times in a function.

Numba keeps what it compiles by the flags among others, and hashes and compares all forty of them
each time: a tenth of its time in Python.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from numba.core.compiler import Flags
from numba.core.targetconfig import TargetConfig


@cache
def quicken_flags() -> bool:
    """Make numba's flags equal and hash as before, in less time; return whether that was done.

    It is left if this version of numba hashes the values of flags, not their names alone.
    """
    some, others = Flags(), Flags()
    # Options are descriptors, of which the types know nothing.
    others.nrt = not others.nrt  # type: ignore[misc, assignment]
    if hash(some) != hash(others) or some == others:
        return False
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
    return True
