"""Arrays without an owner: what the inner loops are given, so that they count no references.

Numba counts references to an array wherever a function takes one out of a named tuple or hands it
on, by an atomic operation on a counter that all threads share. In the sweep that took a third of
the time of one thread and kept two from being twice as fast. An array without an owner has no
counter. Whoever borrows must see to it that the owner outlives the loan: entry points borrow
their own arguments, which their callers hold.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

_Owned = TypeVar("_Owned")


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Return the value with every array in it, however deep in tuples, stripped of its owner."""
    if isinstance(kind, types.Array):
        proxy: Any = cgutils.create_struct_proxy
        array = proxy(kind)(context, builder, value)
        array.meminfo = ir.Constant(array.meminfo.type, None)
        array.parent = ir.Constant(array.parent.type, None)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        for i, member in enumerate(members):
            inner = builder.extract_value(value, i)
            stripped = _without_owner(context, builder, member, inner)
            value = builder.insert_value(value, stripped, i)
    return value


if TYPE_CHECKING or vars(numba.config)["DISABLE_JIT"]:

    def borrowed(owned: _Owned) -> _Owned:
        """Return an array, or a tuple with arrays in it, that does not own its memory."""
        # Without a compiler there is no counting.
        return owned

else:

    @intrinsic
    def borrowed(_typing_context, owned):
        """Return an array, or a tuple with arrays in it, that does not own its memory."""

        def codegen(context, builder, signature, arguments):
            return _without_owner(context, builder, signature.args[0], arguments[0])

        return owned(owned), codegen
