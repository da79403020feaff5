"""A second process that compiles while this one does.

Numba compiles on one processor. What is needed afterwards can be compiled at the same time by
another process, into the cache on disk that both share.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from tcs.files.memory import is_limited
from tcs.kernel.cache import announced, jit_folder
from tcs.kernel.quick_numba import quicken_numba

_CODE = "from tcs.kernel.second_process import do_call; do_call()"


@contextmanager
def compiled_beside(
    function: Callable[..., object],
    *arguments: object,
    first: Callable[[], object] | None = None,
) -> Iterator[None]:
    """Call a function in a second process as soon as anything is compiled within the context.

    What it compiles is in the cache at the end of the context, unless the second process failed or
    was not begun: for want of a second processor, of a cache, or of room in memory.

    Args:
        function: A function of a module that imports little.
        *arguments: Its arguments.
        first: Called in this process once the second one is begun, before anything else is
            compiled: compiles what the second one, which has more to do, comes to later.
    """
    begun: list[subprocess.Popen[bytes]] = []
    useful = _processors() > 1 and jit_folder() is not None and not is_limited()

    def begin() -> None:
        _begin(begun, (function, arguments))
        if begun and first is not None:
            first()

    try:
        with announced(begin if useful else None):
            yield
        for process in begun:
            process.wait()
    finally:
        for process in begun:
            process.kill()
            process.wait()


def _begin(begun: list[subprocess.Popen[bytes]], call: tuple[Any, ...]) -> None:
    """Begin a call in a process of its own."""
    # Not a fork: the threads of Drake and of linear algebra would not be there.
    with suppress(OSError):
        process = subprocess.Popen(
            [sys.executable, "-c", _CODE],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        begun.append(process)
        assert process.stdin is not None
        with process.stdin as stream:
            pickle.dump(call, stream)


def do_call() -> None:
    """Do the call that comes by the standard input; the second process does nothing else."""
    quicken_numba()
    # Read as a whole, that the other process may go on: the modules take a second to import.
    function, arguments = pickle.loads(sys.stdin.buffer.read())
    function(*arguments)


def _processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
