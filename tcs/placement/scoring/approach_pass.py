"""The second pass over a scored grid: approaches of what is reached, kept in blocks too."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.files.blocks import BlockFolder, Blocks, opened_if
from tcs.files.mapped import release
from tcs.kernel.arrays import GridArrays
from tcs.kernel.scores import JOINTS
from tcs.placement.scoring import engines
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.scoring.blocks import Block, Kept

if TYPE_CHECKING:
    from tcs.kernel.approach.sweep import ApproachLines


class GridScores(NamedTuple):
    """The scores of a grid as the kernel gives them, and where blocks of them are kept."""

    reason: NDArray[np.uint8]
    """Codes of reasons, shape (H, G)."""
    contact: NDArray[Any]
    """Contact codes or -1, shape (H, G)."""
    dexterity: NDArray[np.float32]
    """Dexterity measure, shape (H, G)."""
    joints: Mapping[engines.Part, NDArray[np.float32]]
    """Arm joints of the reached pairs of each part of the grid [rad], shapes (reached, 7)."""

    @property
    def winning(self) -> NDArray[np.float32]:
        """Arm joints of all reached pairs [rad], shape (R, 7); parts are finished in any order."""
        parts = (self.joints[part] for part in sorted(self.joints))
        return np.concatenate([np.empty((0, JOINTS), np.float32), *parts])


def score_grid(
    scores: GridScores,
    scorer: ApproachScorer,
    grid: GridArrays,
    *,
    jobs: int,
    ensure: Callable[[], None],
    blocks: BlockFolder | None,
    key: Callable[[], str],
    kept_of: Callable[[Blocks], Kept],
) -> NDArray[np.float32]:
    """Replace the scores of reached pairs by those of their best approachable postures.

    Args:
        scores: The scores, replaced; in blocks, if there is a folder of them.
        scorer: Scores the approaches.
        grid: The configurations.
        jobs: Number of threads; the scores do not depend on it.
        ensure: Starts the kernel; called if something has to be scored.
        blocks: Folder to keep finished blocks in, and to take them from; None to keep none.
        key: Returns the hash of everything that the scores without approach follow from.
        kept_of: Returns the blocks of a grid in their folder.

    Returns:
        Arm joints of the pairs that remain reached [rad].

    Raises:
        OutputError: If blocks cannot be kept in the folder, or another process is at work there.
    """
    reason, contact, dexterity, joints = scores
    with opened_if(blocks, lambda: approaches_key(key(), scorer.lines)) as opened:
        if opened is None:
            ensure()
            return scorer.score(grid, reason, contact, dexterity, scores.winning, jobs=jobs)
        kept, remaining = kept_of(opened), {}
        for part in sorted(joints):
            rows = slice(part.start, part.stop)
            block = kept.load(*part)
            if block is None:
                ensure()
                here = reason[rows], contact[rows], dexterity[rows]
                found = scorer.score(grid, *here, joints[part], jobs=jobs, first=part.start)
                block = Block(*here, found)
                kept.save(part.start, block)
            reason[rows], contact[rows], dexterity[rows] = block[:3]
            remaining[part] = block.joints
            for array in (reason, contact, dexterity):
                release(array)
    return scores._replace(joints=remaining).winning


def approaches_key(scores: str, lines: ApproachLines) -> str:
    """Return the hash of what scores with approach follow from: 64 hex digits.

    Args:
        scores: That of the scores without approach.
        lines: The approaches of the goals.
    """
    sha = hashlib.sha256(f"approach\0{scores}\0".encode())
    for values in lines:
        sha.update(np.asarray(values, dtype="<f8").tobytes())
    return sha.hexdigest()
