"""What the first job would wait for, done in a thread once the service answers."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Sequence

from tcs.errors import TcsError

_LOG = logging.getLogger(__name__)


class Preparation:
    """Steps that a thread does one after the other, until it is stopped.

    A step that fails ends the preparation: the job that needs it does it again, and reports why.
    """

    def __init__(
        self, steps: Sequence[Callable[[], None]], on_end: Callable[[], object] | None = None
    ) -> None:
        """Start the thread.

        Args:
            steps: What is done.
            on_end: Called by the thread at the end, after a step that failed too, unless stopped.
        """
        self._steps, self._on_end, self._stopped = tuple(steps), on_end, threading.Event()
        # Not a daemon: native code that is being loaded must not meet the end of the interpreter.
        self._thread = threading.Thread(target=self._run, name="tcs-preparation")
        self._thread.start()

    def _run(self) -> None:
        for step in self._steps:
            if self._stopped.is_set():
                return
            try:
                step()
            except (TcsError, RuntimeError, ImportError, MemoryError, OSError) as error:
                _LOG.info("not prepared: %s", error)
                break
        if self._on_end is not None and not self._stopped.is_set():
            self._on_end()

    def wait(self) -> None:
        """Wait until all steps are done."""
        self._thread.join()

    def stop(self) -> None:
        """Stop after the present step, and wait until it is done."""
        self._stopped.set()
        self._thread.join()
