"""Pages of score files, made by a process of their own: the scene in 3-D, and the report.

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
_KINDS = {"3-D view": ("view", "--export"), "report": ("report", "--out")}
"""Pages by what they show: the command that writes one, and its option for the path."""


class Views:
    """Pages of score files; one is made at a time."""

    def __init__(self, files: ScoreFiles) -> None:
        """Make pages of the files of a service."""
        self._files = files
        self._lock = threading.Lock()
        self._pages: dict[tuple[str, str], bytes] = {}

    def page(self, digest: str, kind: str = "3-D view") -> bytes:
        """Return a page of a score file, kept from the last time if it was made before.

        Args:
            digest: The score file.
            kind: "3-D view" or "report".

        Raises:
            NotFoundError: If the score file is not held.
            BusyError: If another page is being made.
            ServiceError: If it cannot be made.
        """
        self._files.for_scene(digest)
        if (digest, kind) in self._pages:
            return self._pages[digest, kind]
        if not self._lock.acquire(blocking=False):
            raise BusyError("another page is being made. Try again in some seconds.")
        try:
            with scratch_folder() as folder:
                page = _exported(self._files.content(digest), folder, kind)
            while len(self._pages) >= _KEPT:
                del self._pages[next(iter(self._pages))]
            self._pages[digest, kind] = page
            return page
        finally:
            self._lock.release()


def _exported(content: bytes, folder: Path, kind: str) -> bytes:
    """Return the page that a command writes."""
    file, page = folder / "scored.tcs", folder / "page.html"
    file.write_bytes(content)
    verb, option = _KINDS[kind]
    command = [sys.executable, "-m", "tcs", verb, str(file), option, str(page)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_SECONDS, check=False, cwd=folder
        )
    except subprocess.TimeoutExpired:
        raise ServiceError(f"the {kind} took longer than {_SECONDS:g} s.") from None
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise ServiceError(f"the {kind} cannot be made: {lines[-1].removeprefix('tcs: ')}")
    return page.read_bytes()
