"""Pages of scenes in 3-D, made by a process of their own.

A Meshcat that is collected on another thread than its own ends the process, so none is made in the
process of the service.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

from tcs.errors import BusyError, ServiceError
from tcs.files.writing import scratch_folder
from tcs.service.score_files import ScoreFiles

_SECONDS = 180.0
"""Longest duration of the making of a page [s]."""
_KEPT = 4
"""Most pages that are kept, of some megabytes each."""


class Views:
    """Pages of score files in 3-D; one is made at a time."""

    def __init__(self, files: ScoreFiles) -> None:
        """Make pages of the files of a service."""
        self._files = files
        self._lock = threading.Lock()
        self._pages: dict[str, bytes] = {}

    def page(self, digest: str) -> bytes:
        """Return the page of a score file, kept from the last time if it was made before.

        Raises:
            NotFoundError: If the score file is not held.
            BusyError: If another page is being made.
            ServiceError: If it cannot be made.
        """
        self._files.for_scene(digest)
        if digest in self._pages:
            return self._pages[digest]
        if not self._lock.acquire(blocking=False):
            raise BusyError("another 3-D view is being made. Try again in some seconds.")
        try:
            with scratch_folder() as folder:
                page = _exported(self._files.content(digest), folder)
            while len(self._pages) >= _KEPT:
                del self._pages[next(iter(self._pages))]
            self._pages[digest] = page
            return page
        finally:
            self._lock.release()


def _exported(content: bytes, folder: Path) -> bytes:
    """Return the page that `tcs view --export` writes."""
    file, page = folder / "scored.tcs", folder / "view.html"
    file.write_bytes(content)
    command = [sys.executable, "-m", "tcs", "view", str(file), "--export", str(page)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, check=False, cwd=folder
        )
    except subprocess.TimeoutExpired:
        raise ServiceError(f"the 3-D view took longer than {_SECONDS:g} s.") from None
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise ServiceError(f"the 3-D view cannot be made: {lines[-1].removeprefix('tcs: ')}")
    return page.read_bytes()
