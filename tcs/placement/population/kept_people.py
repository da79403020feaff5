"""People in blocks: what becomes of the goals for them is evaluated once and kept in a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.blocks import Blocks
from tcs.files.compression import compress, decompress
from tcs.kernel.arrays import IntArray
from tcs.kernel.rows import Rows
from tcs.model.people import Scale
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.tables import Reason

BLOCK = 100
"""People of a block: a second of work or less."""
PROBES = 4
"""People whose scenes are part of a block's name."""


@dataclass(frozen=True, slots=True)
class KeptPeople:
    """The blocks of some configurations for some people."""

    blocks: Blocks
    inputs: str
    """Hash of what all blocks follow from, beside the key of the folder."""
    of_people: tuple[bytes, ...]
    """What is particular to each person: how the parts are stretched, and the errors."""
    shape: tuple[int, int]
    """Numbers of configurations and of goals."""

    @classmethod
    def of(
        cls,
        blocks: Blocks,
        poses: Rows,
        scales: Sequence[Mapping[str, Scale]],
        offsets: Offsets | None,
        *,
        scenes: str,
        goals: int,
    ) -> Self:
        """Return the blocks of some configurations for some people.

        Args:
            blocks: Where they are kept.
            poses: The configurations.
            scales: How the parts of each of N people are stretched.
            offsets: Errors of the environment's joints for each, shapes (N,); None for no errors.
            scenes: Hash of the scenes of the first `PROBES` people, as the kernel sees them.
            goals: Number of goals.
        """
        sha = hashlib.sha256(f"people\0{scenes}\0{sorted(offsets or ())}\0".encode())
        for part in poses:
            sha.update(np.asarray(part, dtype="<f8").tobytes())
        errors = [np.asarray(values, "<f8") for _, values in sorted((offsets or {}).items())]
        of_people = tuple(
            repr(sorted(one.items())).encode() + b"".join(values[i].tobytes() for values in errors)
            for i, one in enumerate(scales)
        )
        return cls(blocks, sha.hexdigest(), of_people, (poses.state.size, goals))

    def load(self, people: IntArray) -> NDArray[np.uint8] | None:
        """Return the reasons for some people; None if they have to be evaluated.

        Args:
            people: Their numbers, shape (n,).

        Returns:
            Codes of reasons, shape (configurations, n, goals).
        """
        return self.blocks.load(self._name(people), lambda content: self._decode(content, people))

    def save(self, people: IntArray, reasons: NDArray[np.uint8]) -> None:
        """Write the reasons for some people, as returned by `load`.

        Raises:
            OutputError: If they cannot be written.
        """
        self.blocks.save(self._name(people), {"reason": compress(reasons)})

    def _name(self, people: IntArray) -> str:
        sha = hashlib.sha256(self.inputs.encode())
        for person in people.tolist():
            sha.update(hashlib.sha256(self.of_people[person]).digest())
        return sha.hexdigest()[:24]

    def _decode(self, content: dict[str, Any], people: IntArray) -> NDArray[np.uint8]:
        rows, goals = self.shape
        reason = decompress(content, "reason", "u1", (rows, people.size, goals))
        if reason.max(initial=0) > max(Reason):
            raise StoreFormatError("has codes that do not exist")
        return reason
