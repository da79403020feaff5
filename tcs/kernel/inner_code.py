"""Code of functions that compiled functions call, optimised once, with the function Python calls.

Numba optimises a function together with all that it calls, and generates the machine code of it
all, before it does the same for the caller: a function is optimised as often as its callers are
nested. The functions of `InnerCompiler` are linked only. On disk they are kept as they are linked,
for functions that another process compiles.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, compile_result

from tcs.kernel.machine_code import CodeCache, CodeImplementation


class InnerLibrary(JITCodeLibrary):
    """A function and all that it calls, for the libraries of its callers."""

    def _optimize_final_module(self) -> None:
        """Leave that to the library of the function that Python calls."""

    def _finalize_final_module(self) -> None:
        """Add no machine code to the process."""
        self._finalize_dynamic_globals()
        self._finalized = True


class InnerCompiler(Compiler):
    """Compiles a function as far as its `InnerLibrary`."""

    def __init__(
        self,
        typing_context: Any,
        target_context: Any,
        _library: None,
        args: Any,
        return_type: Any,
        flags: Any,
        local_types: Any,
    ) -> None:
        """As numba's compiler, except that the library is new and nothing is executable."""
        flags.no_compile = True
        library = InnerLibrary(target_context.codegen(), "inner")
        super().__init__(
            typing_context, target_context, library, args, return_type, flags, local_types
        )


class _InnerImplementation(CodeImplementation):
    """Keeps the bit code of a library in place of its machine code."""

    def reduce(self, compiled: Any) -> tuple[Any, ...]:
        """Return what `rebuild` needs."""
        description = compiled.fndesc
        # As numba does: they are not needed any more, and large.
        description.typemap = description.calltypes = None
        bit_code = compiled.library._get_module_for_linking().as_bitcode()
        return bit_code, description, compiled.environment, compiled.signature

    def rebuild(self, target_context: Any, payload: tuple[Any, ...]) -> Any:
        """Return the compiled function."""
        bit_code, description, environment, signature = payload
        library = InnerLibrary(target_context.codegen(), "inner")
        library._final_module = llvm.parse_bitcode(bit_code)
        library._finalize_final_module()
        return compile_result(
            typing_context=target_context.typing_context,
            target_context=target_context,
            entry_point=inner_key(),
            signature=signature,
            objectmode=False,
            fndesc=description,
            library=library,
            environment=environment,
        )


def inner_key() -> object:
    """Return an object by which numba finds a compiled function, in place of its entry point."""
    return object()


class InnerCache(CodeCache):
    """Cache of a function compiled by `InnerCompiler`."""

    _impl_class = _InnerImplementation
    _suffix = "-inner"
