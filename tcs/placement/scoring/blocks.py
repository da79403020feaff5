"""Blocks of a grid, kept in a folder as soon as they are scored, so that a killed run continues."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.errors import OutputError, StoreFormatError, TcsError
from tcs.files.compression import AtMost, compress, decompress
from tcs.files.joblib_file import JoblibFormat
from tcs.files.writing import make_folder, remove_leftovers
from tcs.kernel import cache
from tcs.model.scene import LoweredScene
from tcs.placement.tables import Reason

_log = logging.getLogger(__name__)

BLOCK = 32 * 1024
"""Configurations of a block: a second of work or less, and files of a megabyte."""

FORMAT = JoblibFormat(
    what="Block of scores",
    name="tcs block",
    version=1,
    again="It is scored again.",
)


class Block(NamedTuple):
    """Scores of consecutive configurations; row 0 is the first of them."""

    reason: NDArray[np.uint8]
    """Codes of reasons, shape (n, goals)."""
    contact: NDArray[np.int32]
    """Contact codes or -1, shape (n, goals)."""
    dexterity: NDArray[np.float32]
    """Dexterity measure, shape (n, goals)."""
    joints: NDArray[np.float32]
    """Joint angles of the reached pairs, in order of the rows [rad], shape (reached, joints)."""


@dataclass(frozen=True, slots=True)
class Kept:
    """The blocks of one grid in its folder."""

    folder: Path
    key: str
    """Hash of everything that the scores follow from."""
    goals: int
    joints: int
    contacts: int
    """Number of contact codes."""

    def load(self, start: int, stop: int) -> Block | None:
        """Return the block of configurations start <= h < stop; None if it has to be scored.

        A damaged block, or one of other inputs, is told in a warning.
        """
        path = self._path(start)
        if not path.exists():
            return None
        try:
            return FORMAT.load(path, lambda content: self._decode(content, start, stop))
        except TcsError as error:
            _log.warning("%s", error)
            return None

    def has(self, start: int) -> bool:
        """Return whether there is a file of the block from a configuration on."""
        return self._path(start).exists()

    def save(self, start: int, block: Block) -> None:
        """Write a block, completely or not at all.

        Raises:
            OutputError: If it cannot be written.
        """
        arrays = {name: compress(values) for name, values in self._stored(block).items()}
        FORMAT.save(self._path(start), {"key": self.key, "start": start, **arrays})

    def _path(self, start: int) -> Path:
        return self.folder / f"{start:010d}.block"

    def _stored(self, block: Block) -> dict[str, NDArray[Any]]:
        # Arrays are stored without a sign.
        return {**block._asdict(), "contact": (block.contact + 1).astype(np.uint32)}

    def _decode(self, content: dict[str, Any], start: int, stop: int) -> Block:
        if content.get("key") != self.key or content.get("start") != start:
            raise StoreFormatError("is of another run")
        shape = (stop - start, self.goals)
        reason = decompress(content, "reason", "u1", shape)
        contact = decompress(content, "contact", "u4", shape).astype(np.int64) - 1
        joints = decompress(content, "joints", "f4", (AtMost(reason.size), self.joints))
        if reason.max(initial=0) > max(Reason) or contact.max(initial=0) >= self.contacts:
            raise StoreFormatError("has codes that do not exist")
        if len(joints) != np.count_nonzero(reason == Reason.REACHED):
            raise StoreFormatError("has joints for other pairs than are reached")
        dexterity = decompress(content, "dexterity", "f4", shape)
        return Block(reason, contact.astype(np.int32), dexterity, joints)


def key_of(lowered: LoweredScene, measure: str, excluded: NDArray[np.bool_] | None) -> str:
    """Return the hash of everything that the scores of a grid follow from: 64 hex digits.

    That are scene, goals and grid, the measure, what is left out, the kernel's sources, and what
    compiles and runs them.
    """
    sha = hashlib.sha256()
    kernel = cache.kernel_digest(Path(cache.__file__).parent)
    for part in (lowered.digest(), measure, kernel, FORMAT.version):
        sha.update(f"{part}\0".encode())
    if excluded is not None:
        sha.update(np.packbits(excluded).tobytes())
    return sha.hexdigest()


@dataclass(frozen=True, slots=True)
class BlockFolder:
    """Folder of finished blocks; runs with other inputs have folders of their own inside it."""

    path: Path
    restart: bool = False
    """Whether to discard the finished blocks of the same inputs."""

    @contextlib.contextmanager
    def opened(self, key: str, *, goals: int, joints: int, contacts: int) -> Iterator[Kept]:
        """Yield the blocks of the inputs with a key, locked for this process.

        Args:
            key: Of `key_of`.
            goals: Number of goals.
            joints: Number of joints of the arm.
            contacts: Number of contact codes.

        Raises:
            OutputError: If the folder cannot be made, or another process is at work on the same
                inputs in it.
        """
        folder = self.path / key[:16]
        make_folder(folder, "Folder of blocks")
        with _locked(folder / "lock"):
            remove_leftovers(folder)
            if self.restart:
                for block in folder.glob("*.block"):
                    block.unlink()
            yield Kept(folder, key, goals, joints, contacts)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock a file for this process, and write the process's number into it.

    Raises:
        OutputError: If another process has locked it, or it cannot be written.
    """

    def unwritable(error: OSError) -> OutputError:
        return OutputError(
            f"Folder of blocks '{path.parent}' cannot be written: {error.strerror}. "
            "Name another folder."
        )

    try:
        # Without a buffer, which a full disk would keep from being closed.
        stream = path.open("a+b", buffering=0)
    except OSError as error:
        raise unwritable(error) from error
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            stream.seek(0)
            process = stream.read(20).decode(errors="replace").strip() or "unknown"
            raise OutputError(
                f"Folder of blocks '{path.parent}' is in use by process {process}, which scores "
                "the same. Wait for it, or name another folder."
            ) from None
        try:
            stream.truncate(0)
            stream.write(str(os.getpid()).encode())
        except OSError as error:
            raise unwritable(error) from error
        yield
