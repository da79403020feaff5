"""Outcomes of motions in blocks: what was examined once is taken from a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.blocks import Blocks
from tcs.files.compression import compress, decompress
from tcs.model.program import program_digest
from tcs.motion.stops import BodyPair, StopGrid
from tcs.placement.tables import MotionOutcome, MotionTable

Outcomes = list[tuple[MotionOutcome, BodyPair | None]]
"""What becomes of each goal from one configuration, and the bodies that are in the way."""


def outcomes_key(hands: Sequence[StopGrid], seed: int) -> str:
    """Return the hash of what the outcomes at all configurations follow from.

    Args:
        hands: The stops of each hand.
        seed: Seed of the planner.
    """
    sha = hashlib.sha256(f"motions\0{program_digest()}\0{seed}\0".encode())
    for hand in hands:
        spec = hand.job.spec
        documents = (spec.robot.model_dump_json(), spec.environment.model_dump_json())
        for text in (repr(hand.job.task), *documents):
            sha.update(text.encode() + b"\0")
        sha.update(hand.lowered.digest().encode())
        for rates in (hand.rests, hand.velocity, hand.acceleration):
            sha.update(np.asarray(rates, dtype="<f8").tobytes())
    return sha.hexdigest()


@dataclass(frozen=True, slots=True)
class KeptOutcomes:
    """The outcomes at some configurations, as they are kept in a folder."""

    blocks: Blocks
    table: int
    """Number of the table of the score file."""

    def load(
        self, configurations: NDArray[np.int32], served: NDArray[np.uint8]
    ) -> list[Outcomes] | None:
        """Return the outcomes at configurations; None if they have to be examined.

        Args:
            configurations: Flat indices, shape (n,).
            served: Number of the hand at each goal plus 1, 0 for none, shape (n, goals).
        """

        def decode(content: dict[str, Any]) -> list[Outcomes]:
            outcome = decompress(content, "outcome", "u1", served.shape)
            pair = decompress(content, "pair", "u4", served.shape).astype(np.int64) - 1
            names = content.get("names")
            if not isinstance(names, list) or not all(map(_is_pair, names)):
                raise StoreFormatError("has no names of bodies")
            if outcome.max(initial=0) > max(MotionOutcome) or pair.max(initial=-1) >= len(names):
                raise StoreFormatError("has codes that do not exist")
            bodies: list[BodyPair | None] = [*map(tuple, names), None]
            return [
                [(MotionOutcome(code), bodies[i]) for code, i in zip(*of_row, strict=True)]
                for of_row in zip(outcome.tolist(), pair.tolist(), strict=True)
            ]

        return self.blocks.load(self._name(configurations, served), decode)

    def save(
        self,
        configurations: NDArray[np.int32],
        served: NDArray[np.uint8],
        outcomes: list[Outcomes],
    ) -> None:
        """Write the outcomes at configurations.

        Raises:
            OutputError: If they cannot be written.
        """
        found = table_of(configurations, outcomes, served.shape[1])
        content = {
            "outcome": compress(found.outcome),
            # Arrays are stored without a sign.
            "pair": compress((found.pair + 1).astype(np.uint32)),
            "names": [list(pair) for pair in found.pair_names],
        }
        self.blocks.save(self._name(configurations, served), content)

    def _name(self, configurations: NDArray[np.int32], served: NDArray[np.uint8]) -> str:
        sha = hashlib.sha256(f"{self.table}\0".encode())
        sha.update(np.asarray(configurations, dtype="<i8").tobytes())
        sha.update(served.tobytes())
        return sha.hexdigest()[:24]


def table_of(
    configurations: NDArray[np.int32], outcomes: list[Outcomes], goals: int
) -> MotionTable:
    """Return outcomes as a table.

    Args:
        configurations: Flat indices, ascending, shape (n,).
        outcomes: The outcomes at each of them.
        goals: Number of goals.
    """
    names: dict[BodyPair, int] = {}
    outcome = np.zeros((len(outcomes), goals), np.uint8)
    pair = np.full((len(outcomes), goals), -1, np.int32)
    for row, of_goals in enumerate(outcomes):
        for goal, (result, bodies) in enumerate(of_goals):
            outcome[row, goal] = result
            if bodies is not None:
                pair[row, goal] = names.setdefault(bodies, len(names))
    return MotionTable(
        configurations=configurations, outcome=outcome, pair=pair, pair_names=tuple(names)
    )


def _is_pair(names: object) -> bool:
    return (
        isinstance(names, list) and len(names) == 2 and all(isinstance(name, str) for name in names)
    )
