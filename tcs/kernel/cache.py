"""Compile kernel functions, and cache the machine code in a folder that cannot go stale.

Numba's cache depends only on the source file of the function: after an edit of a module that this
file imports, it would load outdated machine code. Kernel functions are therefore cached under a
hash of the sources that decide their code (`tcs.kernel.sources`), in a folder named by a hash of
the modules that compile, the versions of numba, numpy and Python, and the processor, in files that
`tcs.kernel.machine_code` checks before they are loaded.
"""

from __future__ import annotations

import gc
import hashlib
import platform
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import types
from numba.core.registry import CPUDispatcher

from tcs.errors import OutputError
from tcs.files.memory import CODE, COMPILING, check_room
from tcs.files.paths import cache_folder
from tcs.kernel.inner_code import InnerCache, InnerCompiler, inner_key
from tcs.kernel.machine_code import CodeCache, private_folder, warn_once
from tcs.kernel.sources import COMPILER

_Function = TypeVar("_Function", bound=Callable[..., Any])

_WRAPPERS: dict[str, Any] = {"no_cfunc_wrapper": True}
"""Kernel functions are never passed on as function pointers."""

_COLLECTIONS = 100_000, 20, 100
"""Thresholds of garbage collection while numba compiles: it allocates by the million, and keeps
what it allocates. With Python's own thresholds, a tenth of the time goes into looking for garbage;
without collections, compiling takes 140 MB more."""


def kernel_digest(folder: Path) -> str:
    """Return a hash of everything that decides the machine code of a folder, as 16 hex digits.

    Args:
        folder: The folder whose `*.py` files, at any depth, are the kernel's sources.
    """
    return _digest(folder, folder.rglob("*.py"))


def _digest(folder: Path, sources: Iterable[Path]) -> str:
    """Return a hash of sources in a folder, of versions and of the processor."""
    digest = hashlib.sha256()
    for source in sorted(sources):
        name = source.relative_to(folder).as_posix()
        digest.update(name.encode() + b"\0" + source.read_bytes() + b"\0")
    cpu = f"{llvm.get_host_cpu_name()}{llvm.get_host_cpu_features().flatten()}"
    versions = f"{numba.__version__} {np.__version__} {platform.python_version()} {cpu}"
    digest.update(versions.encode())
    return digest.hexdigest()[:16]


@cache
def jit_folder() -> Path | None:
    """Return the folder of the machine code, or None if there is none to be trusted."""
    kernel = Path(__file__).parent
    compiling = [kernel / f"{name.rpartition('.')[2]}.py" for name in COMPILER]
    try:
        return private_folder(private_folder(cache_folder() / "jit") / _digest(kernel, compiling))
    except OutputError as error:
        warn_once("folder", f"The kernel compiles anew in every run: {error}")
        return None


_to_announce: list[Callable[[], None]] = []
"""What is called before the next function is compiled."""


@contextmanager
def announced(on_compile: Callable[[], None] | None) -> Iterator[None]:
    """Call a function, once, before anything is compiled within the context, in any thread.

    Machine code that is loaded for the types of the arguments at hand is not compiled.

    Args:
        on_compile: The function.
    """
    if on_compile is not None:
        _to_announce.append(on_compile)
    try:
        yield
    finally:
        if on_compile in _to_announce:
            _to_announce.remove(on_compile)


def int_constant(number: int) -> int:
    """Return an integer constant to pass to kernel functions, of a type without its value.

    Numba compiles a function anew for every literal, and every global int, passed as an argument.
    """
    return cast(int, np.int64(number))


def jit(function: _Function) -> _Function:
    """Compile `function` with IEEE arithmetic, releasing the GIL, and cache its machine code.

    Division by zero gives inf or nan as in numpy. No `fastmath`: results must not depend on how
    a compiler reorders sums. Contraction to fused multiply-add is off for the same reason.
    """
    compiled = _compiled(function, CodeCache)
    if isinstance(compiled, CPUDispatcher):
        compiled.__class__ = _Entry
        cast(_Entry, compiled).inner = inner(function)
    return cast(_Function, compiled)


def inner(function: _Function) -> _Function:
    """Compile `function` as `jit` does, for calls from compiled functions only.

    It is optimised together with the `jit` function that calls it in the end, see `InnerCompiler`.
    """
    compiled = _compiled(
        function, InnerCache, pipeline_class=InnerCompiler, no_cpython_wrapper=True
    )
    if isinstance(compiled, CPUDispatcher):
        compiled.__class__ = _Inner
    return cast(_Function, compiled)


class _Entry(CPUDispatcher):
    """Dispatcher that Python calls; compiled functions call what it is for them, `inner`."""

    inner: Any

    @property
    def _numba_type_(self) -> types.Dispatcher:
        """Type of the function as compiled functions see it."""
        return types.Dispatcher(self.inner)

    def compile(self, sig: Any) -> Any:
        """Compile for a signature, with everything that the function calls, or load that.

        Raises:
            MemoryError: If the address space is limited, and too little is left: LLVM would end the
                process.
        """
        code: object = self._cache  # type: ignore[attr-defined]
        kept = isinstance(code, CodeCache) and code.path(sig, self.targetctx).exists()
        before = gc.get_threshold()
        gc.set_threshold(*_COLLECTIONS)
        try:
            while not kept and _to_announce:
                _to_announce.pop()()
            check_room(CODE if kept else COMPILING)
            return super().compile(sig)
        finally:
            gc.set_threshold(*before)


class _Inner(CPUDispatcher):
    """Dispatcher of what `InnerCompiler` compiles, which rejects calls from Python."""

    def __call__(self, *args: object) -> NoReturn:
        raise TypeError(
            f"{self.py_func.__name__} is compiled for compiled callers only: "
            "decorate it with `jit` in place of `inner` to call it from Python."
        )

    def add_overload(self, compiled: Any) -> None:
        """Register the code for one signature with those who call it."""
        if compiled.entry_point is None:
            compiled = compiled._replace(entry_point=inner_key())
            self.targetctx.insert_user_function(
                compiled.entry_point, compiled.fndesc, [compiled.library]
            )
        self.overloads[tuple(compiled.signature.args)] = compiled


def _compiled(function: _Function, code_cache: type[CodeCache], **options: Any) -> object:
    """Return `function` decorated with `numba.njit`, cached in `jit_folder()`."""
    decorate: Callable[[_Function], object] = numba.njit(
        nogil=True, error_model="numpy", **_WRAPPERS, **options
    )
    compiled = decorate(function)
    folder = jit_folder()
    # With NUMBA_DISABLE_JIT, functions stay as they are.
    if folder is not None and isinstance(compiled, CPUDispatcher):
        # As numba's own `enable_caching` does.
        compiled._cache = code_cache(function, folder)  # type: ignore[attr-defined]
    return compiled
