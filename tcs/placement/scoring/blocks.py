"""Blocks of a grid: what is kept of consecutive configurations, and what it follows from."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.blocks import FORMAT, Blocks
from tcs.files.compression import AtMost, compress, decompress
from tcs.kernel import cache
from tcs.model.scene import LoweredScene
from tcs.placement.tables import Reason

BLOCK = 32 * 1024
"""Configurations of a block: a second of work or less, and files of a megabyte."""


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

    blocks: Blocks
    """The folder, under the hash of everything that the scores follow from."""
    goals: int
    joints: int
    contacts: int
    """Number of contact codes."""

    def load(self, start: int, stop: int) -> Block | None:
        """Return the block of configurations start <= h < stop; None if it has to be scored.

        A damaged block, or one of other inputs, is told in a warning.
        """
        return self.blocks.load(_name(start), lambda content: self._decode(content, start, stop))

    def has(self, start: int) -> bool:
        """Return whether there is a file of the block from a configuration on."""
        return self.blocks.has(_name(start))

    def save(self, start: int, block: Block) -> None:
        """Write a block, completely or not at all.

        Raises:
            OutputError: If it cannot be written.
        """
        arrays = {name: compress(values) for name, values in self._stored(block).items()}
        self.blocks.save(_name(start), arrays)

    def _stored(self, block: Block) -> dict[str, NDArray[Any]]:
        # Arrays are stored without a sign.
        return {**block._asdict(), "contact": (block.contact + 1).astype(np.uint32)}

    def _decode(self, content: dict[str, Any], start: int, stop: int) -> Block:
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


def _name(start: int) -> str:
    """Return the name of the block from a configuration on."""
    return f"{start:010d}"


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
