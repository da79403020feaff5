"""The memory that a process may still take, where its address space is limited (`ulimit -v`)."""

from __future__ import annotations

import errno
import os
import resource
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

_MEGABYTE = 1024**2
LIBRARIES = {
    "matplotlib": 150 * _MEGABYTE,
    "numba": 200 * _MEGABYTE,
    "pydrake": 200 * _MEGABYTE,
    "scipy.linalg": 150 * _MEGABYTE,
    "scipy.special": 150 * _MEGABYTE,
}
"""Modules that, loaded without enough room, wait for ever or end the process, and the address space
that they take at most, with what they load [bytes]."""
START = (100 + 40 * min(os.cpu_count() or 1, 64)) * _MEGABYTE
"""Address space that Python, NumPy, whose BLAS has a buffer and a stack for each core, and the
modules of the commands take at most [bytes]."""
CODE = 150 * _MEGABYTE
"""Address space that loading the machine code of one command takes at most [bytes]."""
COMPILING = 450 * _MEGABYTE
"""Address space that compiling the scoring kernel and loading it takes at most [bytes]."""
THREAD = 140 * _MEGABYTE
"""Address space that a thread takes: its stack, and the heap of its own that the C library reserves
for it [bytes]."""
_NO_THREAD = ("can't start new thread", "can't allocate lock", "can't allocate read lock")
"""What Python says where there is no room for a thread or its locks."""
WANT_OF_MEMORY = (
    "the memory does not suffice. Score a coarser grid or fewer axes, or use a machine with more; "
    "`tcs score --dry-run` tells how much scores need."
)
"""What a command prints that ends so."""


def is_limited() -> bool:
    """Return whether the address space of this process is limited."""
    return resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY


class _RoomFinder:
    """Finds no module, but refuses to look for one of `LIBRARIES` without room."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> None:
        """Check the room.

        Raises:
            MemoryError: If the address space is limited, and too little is left.
        """
        if fullname in LIBRARIES:
            check_room(LIBRARIES[fullname])


def guard_imports() -> None:
    """Check the room before each module of `LIBRARIES`, where the address space is limited.

    The BLAS of SciPy, for one, asks for its buffers again and again until it gets them.
    """
    if is_limited() and not any(isinstance(finder, _RoomFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _RoomFinder())


def check_room(needed: int = CODE) -> None:
    """Check that a limit leaves room, before code that ends the process where there is none.

    Args:
        needed: Address space that is needed [bytes].

    Raises:
        MemoryError: If the address space is limited and less is left.
    """
    if not is_limited():
        return
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        # Another system, which does not tell.
        return
    left = resource.getrlimit(resource.RLIMIT_AS)[0] - pages * os.sysconf("SC_PAGE_SIZE")
    if left < needed:
        raise MemoryError(f"{left:,} bytes of address space are left; {needed:,} are needed")


def is_for_want_of_memory(error: BaseException) -> bool:
    """Return whether an exception says that memory, or the space of addresses, is used up."""
    return (
        isinstance(error, MemoryError)
        # Libraries that find no address space when they are loaded do not say so.
        or (isinstance(error, ImportError | OSError) and is_limited() and is_of_loading(error))
        or (isinstance(error, RuntimeError) and str(error) in _NO_THREAD)
        # Compiled modules that find no memory while they are imported.
        or (isinstance(error, SystemError) and str(error) == "error return without exception set")
    )


def is_of_loading(error: ImportError | OSError) -> bool:
    """Return whether a shared library, or a compiled module, could not be loaded."""
    texts = ("initialization failed", "shared object", "failed to map", "libllvmlite")
    return (
        error.errno == errno.ENOMEM
        if isinstance(error, OSError) and error.errno
        else any(text in str(error) for text in texts)
    )
