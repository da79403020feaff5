"""Score files of the service, by the digest of their content, bounded in number and size."""

from __future__ import annotations

import hashlib
import itertools
import shutil
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tcs.errors import BusyError, NotFoundError, ServiceError, StoreError
from tcs.files.paths import is_path
from tcs.files.reading import read_bytes
from tcs.files.writing import scratch_folder
from tcs.placement.store import (
    MotionFile,
    ScoreFile,
    load_motions,
    load_scores,
    motion_path,
    save_scores,
)
from tcs.service.limits import Limits
from tcs.service.responses import FileEntry
from tcs.service.sent_documents import entry_of, entry_of_file
from tcs.service.worker import WorkerPool


@dataclass(eq=False)
class HeldFile:
    """A score file that the service holds."""

    entry: FileEntry
    path: Path
    """Its copy in the temporary folder."""
    is_ours: bool
    """Whether it was made here or named when the service started, rather than sent."""
    is_pinned: bool
    """Whether it stays until the service ends."""
    number: int
    """Number of the file, in the order in which they came."""
    is_described: bool
    """Whether its scene is one that a client described, for which there is another process."""
    lock: threading.RLock = field(default_factory=threading.RLock)
    """Held while the file is read: what selection derives from it is kept in it."""

    def __reduce__(self) -> Any:
        """Return it for another process, with a lock of that process."""
        return HeldFile, (
            self.entry,
            self.path,
            self.is_ours,
            False,
            self.number,
            self.is_described,
        )


class ScoreFiles:
    """Score files in a temporary folder; the most recently used are in memory."""

    def __init__(self, folder: Path, limits: Limits, parsing: WorkerPool) -> None:
        """Hold no file yet.

        Args:
            folder: An empty folder for the copies.
            limits: Bounds of number and size.
            parsing: Reads files that are sent.
        """
        self._folder, self._limits, self._parsing = folder, limits, parsing
        self._lock = threading.RLock()
        self._held: OrderedDict[str, HeldFile] = OrderedDict()
        self._loaded: OrderedDict[str, ScoreFile] = OrderedDict()
        self._motions: OrderedDict[str, MotionFile] = OrderedDict()
        self._number = itertools.count()

    def add(
        self, content: Sequence[bytes], *, is_ours: bool = False, is_pinned: bool = False
    ) -> HeldFile:
        """Check a score file and hold it; the same content is held once.

        Args:
            content: The bytes of the file, in parts.
            is_ours: Whether it was made here or named when the service started.
            is_pinned: Whether it stays until the service ends.

        Raises:
            StoreError: If it is not a score file.
            BusyError: If it does not fit beside the pinned files.
        """
        size = sum(map(len, content))
        if size > self._limits.file_bytes and not is_ours:
            raise ServiceError(
                f"the score file has {size:,} bytes; at most {self._limits.file_bytes:,} "
                "are accepted."
            )
        known = hashlib.sha256()
        for part in content:
            known.update(part)
        digest = known.hexdigest()
        if not self._uses(digest, is_ours=is_ours, is_pinned=is_pinned):
            with scratch_folder() as folder:
                path = folder / "sent.tcs"
                with path.open("wb") as stream:
                    stream.writelines(content)
                # Outside the lock: it takes up to seconds, in which other files are used.
                try:
                    entry = self._entry_of(path, digest, is_ours=is_ours)
                except StoreError as error:
                    raise type(error)(str(error).replace(f" '{path}'", " that was sent")) from None
                self.adopt(path, entry, is_ours=is_ours, is_pinned=is_pinned)
        return self.held(digest)

    def adopt(
        self,
        path: Path,
        entry: FileEntry,
        *,
        is_ours: bool = True,
        is_pinned: bool = False,
        is_described: bool = False,
    ) -> HeldFile:
        """Hold a score file that was checked; its file is moved into the folder.

        Args:
            path: The file.
            entry: What it is of.
            is_ours: Whether it was made here or named when the service started.
            is_pinned: Whether it stays until the service ends.
            is_described: Whether its scene is one that a client described.

        Raises:
            BusyError: If it does not fit beside the pinned files.
        """
        with self._lock:
            if not self._uses(entry.file, is_ours=is_ours, is_pinned=is_pinned):
                self._make_space(entry.bytes)
                kept = self._folder / f"{entry.file}.tcs"
                shutil.move(path, kept)
                self._held[entry.file] = HeldFile(
                    entry, kept, is_ours, is_pinned, next(self._number), is_described
                )
            return self._held[entry.file]

    def lend(self, held: HeldFile) -> None:
        """Hold a file of another process, at its path there."""
        with self._lock:
            self._held[held.entry.file] = held

    def _uses(self, digest: str, *, is_ours: bool, is_pinned: bool) -> bool:
        """Return whether a file is held; it is then the most recently used one."""
        with self._lock:
            held = self._held.get(digest)
            if held is None:
                return False
            held.is_ours |= is_ours
            held.is_pinned |= is_pinned
            self._held.move_to_end(digest)
            return True

    def _entry_of(self, path: Path, digest: str, *, is_ours: bool) -> FileEntry:
        """Return what a score file is of; one that was sent is read in a process of its own."""
        if is_ours:
            file = load_scores(path)
            self._remember(digest, file)
            return entry_of(file, digest, path.stat().st_size)
        entry: FileEntry = self._parsing.call(
            entry_of_file, path, digest, self._limits.decoded_bytes,
            seconds=self._limits.parse_seconds, what="the score file",
        )  # fmt: skip
        return entry

    def add_made(self, file: ScoreFile) -> HeldFile:
        """Hold a score file that was made here.

        Raises:
            BusyError: If it does not fit beside the pinned files.
        """
        with scratch_folder() as folder:
            path = folder / "made.tcs"
            save_scores(path, file)
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            return self.adopt(path, entry_of(file, digest, path.stat().st_size))

    def read(self, path: Path) -> HeldFile:
        """Hold a file that is named when the service starts, until it ends, and its motions.

        Raises:
            StoreError: If it or its motions cannot be read, or it is not a score file.
            StoreMismatchError: If the motions were planned for other scores.
        """
        content = read_bytes(
            path, f"Score file '{path}'", StoreError, limit=self._limits.stored_bytes
        )
        held = self.add([content], is_ours=True, is_pinned=True)
        beside = motion_path(path)
        if beside.exists():
            motions = load_motions(beside)
            motions.check_belongs(self.loaded(held.entry.file))
            self.hold_motions(held.entry.file, motions)
        return held

    def entries(self) -> list[FileEntry]:
        """Return the files that are held, in the order in which they came."""
        with self._lock:
            held = sorted(self._held.values(), key=lambda one: one.number)
            return [one.entry for one in held]

    def held(self, digest: str) -> HeldFile:
        """Return a file that is held.

        Raises:
            NotFoundError: If no file of that digest is held.
        """
        with self._lock:
            if digest not in self._held:
                raise NotFoundError(
                    f"no score file {digest[:12]}... is held; send it again. Files that were not "
                    "used for long are removed."
                )
            self._held.move_to_end(digest)
            return self._held[digest]

    def content(self, digest: str) -> bytes:
        """Return the bytes of a file.

        Raises:
            NotFoundError: If no file of that digest is held.
        """
        path = self.held(digest).path
        try:
            # It may take long, in which other files are used.
            return path.read_bytes()
        except FileNotFoundError:
            self.held(digest)
            raise

    def loaded(self, digest: str) -> ScoreFile:
        """Return the content of a file.

        Raises:
            NotFoundError: If no file of that digest is held.
        """
        with self._lock:
            held, file = self.held(digest), self._loaded.get(digest)
        if file is None:
            try:
                # It takes up to seconds, in which other files are used.
                file = load_scores(held.path, None if held.is_ours else self._limits.decoded_bytes)
            except StoreError:
                self.held(digest)
                raise
        with self._lock:
            if digest not in self._loaded:
                self.held(digest)
                self._remember(digest, file)
            self._loaded.move_to_end(digest)
            return self._loaded[digest]

    def for_scene(self, digest: str) -> ScoreFile:
        """Return the content of a file whose scene may be built.

        Raises:
            NotFoundError: If no file of that digest is held.
            ServiceError: If it was sent, and refers to a task, environment or robot by a path.
        """
        file = self.loaded(digest)
        if not self.held(digest).is_ours:
            for key in ("task", "environment", "robot"):
                if is_path(file.metadata[key]):
                    raise ServiceError(
                        f"the score file names its {key} by a path, which is not opened for a file "
                        "that was sent. Score the task on this server."
                    )
        return file

    def motions(self, digest: str) -> MotionFile:
        """Return the motions that were found for a file.

        Raises:
            NotFoundError: If there are none, or they were not used for long.
        """
        with self._lock:
            if digest not in self._motions:
                raise NotFoundError(
                    "no motions of this score file are held. Find them with a job `motions`."
                )
            self._motions.move_to_end(digest)
            return self._motions[digest]

    def known_motions(self, digest: str) -> MotionFile | None:
        """Return the motions that were found for a file, or None."""
        with self._lock:
            return self._motions.get(digest)

    def hold_motions(self, digest: str, motions: MotionFile) -> None:
        """Hold the motions of a file, in place of others of the same file."""
        with self._lock:
            self._motions[digest] = motions
            self._motions.move_to_end(digest)
            while len(self._motions) > self._limits.loaded_files:
                self._motions.popitem(last=False)

    def _remember(self, digest: str, file: ScoreFile) -> None:
        with self._lock:
            self._loaded[digest] = file
            while len(self._loaded) > self._limits.loaded_files:
                self._loaded.popitem(last=False)

    def _make_space(self, size: int) -> None:
        """Remove the least recently used files until another one fits."""
        while sum(held.entry.bytes for held in self._held.values()) + size > (
            self._limits.stored_bytes
        ):
            oldest = next((d for d, held in self._held.items() if not held.is_pinned), None)
            if oldest is None:
                raise BusyError("the score file does not fit beside those that are kept.")
            path = self._held.pop(oldest).path
            # Not that of another process.
            if path.parent == self._folder:
                path.unlink(missing_ok=True)
            self._loaded.pop(oldest, None)
