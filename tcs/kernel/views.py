"""Unowned views of named tuples, for inner loops without reference counting.

Numba passes a named tuple by value, array by array, and counts references wherever a function reads
an array from it, by an atomic operation on a counter shared by all threads. In the sweep this took
a third of the time of one thread and prevented two threads from being twice as fast, and most of
the compile time went into the hundreds of values that every call passes. An unowned view is the
address of one copy of the tuple, whose arrays have no owner. The owner must outlive the view: entry
points take views of their own arguments, which their callers own, and the copy lives until the
entry point returns.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import models
from numba.core.registry import CPUDispatcher
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import intrinsic, lower_getattr_generic, register_model

_Owned = TypeVar("_Owned")


class UnownedView(types.Type):
    """The address of a named tuple whose arrays have no owner."""

    def __init__(self, owned: Any) -> None:
        """Create the type of views of named tuples of the numba type `owned`."""
        # Type names become part of function names; that of the tuple has thousands of characters.
        mark = hashlib.sha256(str(owned).encode()).hexdigest()[:12]
        super().__init__(name=f"UnownedView[{owned.instance_class.__name__},{mark}]")
        self.owned = owned

    @property
    def key(self) -> Any:
        """Identity of the type: the type of the named tuple."""
        return self.owned


@register_model(UnownedView)
class _UnownedViewModel(models.PrimitiveModel):
    def __init__(self, manager: Any, numba_type: UnownedView) -> None:
        super().__init__(
            manager, numba_type, manager[numba_type.owned].get_value_type().as_pointer()
        )


@infer_getattr
class _UnownedViewFields(AttributeTemplate):
    key = UnownedView

    # Numba declares this attribute as NotImplemented, for subclasses to define.
    def generic_resolve(self, value: Any, attr: str) -> Any:  # type: ignore[override]
        """Return the type of a field, a view if the field is a named tuple; None if unknown."""
        if attr not in value.owned.fields:
            return None
        numba_type = value.owned.types[value.owned.fields.index(attr)]
        return (
            UnownedView(numba_type) if isinstance(numba_type, types.BaseNamedTuple) else numba_type
        )


@lower_getattr_generic(UnownedView)
def _field(context: Any, builder: Any, view: Any, address: Any, name: str) -> Any:
    """Return the value of a field, or its address if it is a named tuple."""
    which = view.owned.fields.index(name)
    zero, index = ir.Constant(ir.IntType(32), 0), ir.Constant(ir.IntType(32), which)
    at = builder.gep(address, [zero, index], inbounds=True)
    field = view.owned.types[which]
    if isinstance(field, types.BaseNamedTuple):
        return at
    # The owner removed once more, because the compiler does not see that it has been: where it is
    # a constant, it counts no references.
    return _without_owner(context, builder, field, builder.load(at))


def _without_owner(context: Any, builder: Any, numba_type: Any, value: Any) -> Any:
    """Return the value with the owner removed from every array, in nested tuples too."""
    if isinstance(numba_type, types.Array):
        array = cgutils.create_struct_proxy(numba_type)(context, builder, value)
        array.meminfo = ir.Constant(array.meminfo.type, None)
        array.parent = ir.Constant(array.parent.type, None)
        return array._getvalue()
    if isinstance(numba_type, types.BaseTuple):
        members: Any = numba_type
        for i, member in enumerate(members):
            inner = builder.extract_value(value, i)
            stripped = _without_owner(context, builder, member, inner)
            value = builder.insert_value(value, stripped, i)
    return value


def tuple_class(numba_type: Any) -> type:
    """Return the class of a named tuple from its numba type or the type of a view of it."""
    owned = numba_type.owned if isinstance(numba_type, UnownedView) else numba_type
    return cast(type, owned.instance_class)


def field_class(numba_type: Any, name: str) -> type:
    """Return the class of a field, a named tuple too, of what `tuple_class` takes."""
    owned = numba_type.owned if isinstance(numba_type, UnownedView) else numba_type
    return tuple_class(owned.types[owned.fields.index(name)])


def compile_for_views(function: object, *arguments: object) -> None:
    """Compile a function, or load it, as it is called from compiled functions.

    Args:
        function: A function of `cache.inner` or `cache.jit`.
        *arguments: What it is called with: of named tuples, views are passed, and of a bool or an
            int, the constant.
    """
    callee = getattr(function, "inner", function)
    if isinstance(callee, CPUDispatcher):
        callee.compile(tuple(map(_type_in_call, arguments)))


def _type_in_call(argument: object) -> types.Type:
    """Return the numba type of an argument in a call from a compiled function."""
    if isinstance(argument, (bool, int)):
        return types.literal(argument)
    found = numba.typeof(argument)
    return UnownedView(found) if isinstance(found, types.BaseNamedTuple) else found


if TYPE_CHECKING or vars(numba.config)["DISABLE_JIT"]:

    def unowned(owned: _Owned) -> _Owned:
        """Return an unowned view of a named tuple: fields can be read, and arrays written."""
        # Uncompiled code counts no references.
        return owned

else:

    @intrinsic
    def unowned(_typing_context, owned):
        """Return an unowned view of a named tuple: fields can be read, and arrays written."""

        def codegen(context, builder, signature, arguments):
            value = _without_owner(context, builder, signature.args[0], arguments[0])
            return cgutils.alloca_once_value(builder, value)

        return UnownedView(owned)(owned), codegen
