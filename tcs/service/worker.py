"""Processes for what clients send: it is parsed and built there, with limits of time and memory.

Parsing a text and building a scene in Drake keep every other thread of a process waiting, and a few
bytes may ask for gigabytes. A process that meets a limit is ended; the next call starts another.
"""

from __future__ import annotations

import logging
import os
import pickle
import queue
import resource
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import tcs.errors
import tcs.files.memory
from tcs.errors import BusyError, CancelledError, ServiceError, TcsError, UnknownNameError

_LOG = logging.getLogger(__name__)
_LOOK = 0.1
"""Interval at which a caller looks whether its call was cancelled, and a process for the one that
started it [s]."""
_GRACE = 2.0
"""Time in which a call that was cancelled ends by itself, where it next reports; then its process
is ended, and with it what it keeps from one call to the next [s]."""
_COMMAND = "import sys; from tcs.service.worker import serve; serve(sys.argv[1:])"
Report = Callable[[Any], None]
Look = Callable[[], None]


class Worker:
    """A process that calls functions, one at a time; it is started by the first call."""

    def __init__(self, *, memory: int | None, imports: Sequence[str] = ()) -> None:
        """Start nothing yet.

        Args:
            memory: Most bytes that calls take beyond what the process takes before the first; None
                for no limit.
            imports: Modules that it imports before the first call.
        """
        self._memory, self._imports = memory, tuple(imports)
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None

    def call(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        seconds: float,
        what: str = "the request",
        on_report: Report = lambda _: None,
        look: Look = lambda: None,
    ) -> Any:
        """Return what a function of a module returns; calls are made one after the other.

        Args:
            function: The function; it, its arguments and its result are pickled.
            *arguments: Its arguments.
            seconds: Longest duration [s].
            what: What is parsed or built, for messages.
            on_report: Called with what the function passes to `report`.
            look: Called now and then; what it raises cancels the call.

        Raises:
            ServiceError: If a limit is met.
            TcsError: As the function.
        """
        with self._lock:
            try:
                kind, value = self._answer(
                    function, arguments, time.monotonic() + seconds, on_report, look
                )
            except TimeoutError:
                self.close()
                raise ServiceError(f"{what} takes longer than {seconds:g} s, the limit.") from None
            except (EOFError, OSError):
                # What runs out of memory in compiled code ends the process.
                kind, value = "memory", None
                self.close()
            except CancelledError:
                raise
            except BaseException:
                self.close()
                raise
        if kind == "done":
            return value
        if kind == "memory":
            self.close()
            if self._memory is None:
                raise ServiceError(f"{what} takes more memory than this machine has left.")
            raise ServiceError(f"{what} takes more memory than {self._memory:,} bytes, the limit.")
        if kind == "defect":
            raise RuntimeError(f"{what} failed in a process of its own:\n{value}")
        raise _error_of(*value)

    def _answer(
        self,
        function: Callable[..., Any],
        arguments: Sequence[Any],
        end: float,
        on_report: Report,
        look: Look,
    ) -> tuple[str, Any]:
        """Return how a call ended, and with what."""
        if self._process is None or self._process.poll() is not None:
            self._start()
        connection = self._connection
        assert connection is not None
        connection.send((function, arguments))
        while True:
            try:
                look()
                if time.monotonic() > end:
                    raise TimeoutError
                if connection.poll(_LOOK):
                    kind, value = connection.recv()
                    if kind != "report":
                        return kind, value
                    on_report(value)
            except CancelledError:
                self._cancel(connection)
                raise

    def _cancel(self, connection: Connection) -> None:
        """End the present call where it next reports; if that takes too long, end the process."""
        end = time.monotonic() + _GRACE
        with suppress(EOFError, OSError):
            connection.send(None)
            while connection.poll(max(end - time.monotonic(), 0.0)):
                if connection.recv()[0] != "report":
                    return
        self.close()

    def _start(self) -> None:
        self.close()
        ours, theirs = socket.socketpair()
        with theirs:
            # Standard output belongs to the answers of an assistant, and Ctrl-C to this process.
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _COMMAND, str(theirs.fileno()),
                 str(self._memory or 0), *self._imports],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=[theirs.fileno()],
                start_new_session=True, env=os.environ | {"PYTHONPATH": os.pathsep.join(_paths())},
            )  # fmt: skip
        self._connection = Connection(ours.detach())

    def close(self) -> None:
        """End the process; the next call starts another."""
        process, connection = self._process, self._connection
        self._process = self._connection = None
        if process is not None:
            process.kill()
            process.wait()
        if connection is not None:
            connection.close()


class WorkerPool:
    """Some processes, of which each call takes one that is free."""

    def __init__(self, count: int, *, memory: int, imports: Sequence[str] = ()) -> None:
        """Start nothing yet; as `Worker`."""
        self._workers = [Worker(memory=memory, imports=imports) for _ in range(count)]
        # The one used last: another is started only while that is busy.
        self._free: queue.LifoQueue[Worker] = queue.LifoQueue()
        for one in self._workers:
            self._free.put(one)

    def start(self) -> None:
        """Start the process of the next call, if it has not been: importing takes a second."""
        with suppress(BusyError):
            self.call(os.getpid, seconds=60.0, what="the start")

    def call(self, function: Callable[..., Any], *arguments: Any, seconds: float, what: str) -> Any:
        """Return what a function returns; as `Worker.call`.

        Raises:
            BusyError: If no process becomes free within that time.
        """
        try:
            worker = self._free.get(timeout=seconds)
        except queue.Empty:
            raise BusyError("other large requests are being read. Try again.") from None
        try:
            return worker.call(function, *arguments, seconds=seconds, what=what)
        finally:
            self._free.put(worker)

    def close(self) -> None:
        """End the processes."""
        for one in self._workers:
            one.close()


def _paths() -> list[str]:
    """Return where a process finds the modules of this one."""
    package = Path(tcs.errors.__file__).parent.parent
    return list(dict.fromkeys([str(package), *(path for path in sys.path if path)]))


def _error_of(name: str, arguments: tuple[Any, ...], where: str) -> TcsError:
    """Return an exception that a process has raised."""
    if name == UnknownNameError.__name__:
        return UnknownNameError(*arguments, where=where)
    error: TcsError = getattr(tcs.errors, name)(*arguments)
    return error


# ---- In the process -----------------------------------------------------------------------------

_connection: Connection | None = None


def report(value: Any) -> None:
    """Pass a value to the caller of the present call, in the process that makes it.

    Raises:
        CancelledError: If the call was cancelled.
    """
    assert _connection is not None
    _connection.send(("report", value))
    if _connection.poll():
        # During a call, nothing else is sent.
        _connection.recv()
        raise CancelledError("the call was cancelled.")


def serve(arguments: Sequence[str]) -> None:
    """Make the calls that arrive, until the other process ends."""
    global _connection
    descriptor, memory, *imports = arguments
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    for name in imports:
        import_module(name)
    if int(memory):
        _limit(int(memory))
    _connection = Connection(int(descriptor))
    with suppress(EOFError, OSError):
        while True:
            call = _connection.recv()
            # A call that had ended may have been cancelled.
            if call is not None:
                _connection.send(_outcome(*call))


def _outcome(function: Callable[..., Any], given: Sequence[Any]) -> tuple[str, Any]:
    """Return how a call ended, and with what."""
    try:
        result = "done", function(*given)
        pickle.dumps(result)
        return result
    except UnknownNameError as error:
        return "error", (type(error).__name__, (error.what, error.name, error.known), error.where)
    except TcsError as error:
        return "error", (type(error).__name__, (str(error),), "")
    except (MemoryError, RecursionError):
        return "memory", None
    except Exception as error:
        if tcs.files.memory.is_for_want_of_memory(error):
            return "memory", None
        import traceback

        return "defect", traceback.format_exc()


def _limit(memory: int) -> None:
    """Limit the address space of this process to what it takes now, and more."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError):
        # Another system, which does not tell, nor keeps such a limit.
        return
    most = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.getrlimit(resource.RLIMIT_AS)[1]))


def _end_with(parent: int) -> None:
    """End this process when the one that started it has ended."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(0)
