"""Blocks of a grid: what is kept of consecutive configurations, also for similar tasks."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import StoreFormatError
from tcs.files.blocks import FORMAT, Blocks
from tcs.files.compression import AtMost, compress, decompress
from tcs.files.reading import read_text
from tcs.files.writing import whole_file
from tcs.kernel import cache
from tcs.kernel.arrays import SceneArrays
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


MANIFEST = "goals.json"
"""File in a folder of blocks that says which goals they are of."""
MOST_BYTES = 1024**2
"""Greatest size of a manifest [bytes]; a goal takes some eighty."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """What the blocks of a folder follow from, goal by goal."""

    key: str
    """Hash of everything, as `key_of`."""
    rest: str
    """Hash of everything but the goals."""
    goals: tuple[str, ...]
    """Hash of each goal; () if one of them is not a single pose: it is scored with the others."""

    @classmethod
    def of(cls, lowered: LoweredScene, measure: str, excluded: NDArray[np.bool_] | None) -> Self:
        """Return the manifest of a scene with its goals, and what else the scores follow from."""
        arrays = lowered.arrays
        are_poses = all(map(arrays.is_single_pose, range(arrays.goals)))
        goals = range(arrays.goals if are_poses and not len(arrays.freedom) else 0)
        return cls(
            key=key_of(lowered, measure, excluded),
            rest=key_of(with_goals(lowered, []), measure, excluded),
            goals=tuple(_goal_digest(with_goals(lowered, [g])) for g in goals),
        )

    def save(self, folder: Path) -> None:
        """Write it into a folder of blocks, unless it is there.

        Raises:
            OutputError: If it cannot be written.
        """
        if not (folder / MANIFEST).exists():
            content = {"key": self.key, "rest": self.rest, "goals": list(self.goals)}
            with whole_file(folder / MANIFEST, "Folder of blocks") as stream:
                stream.write(json.dumps(content).encode())

    @classmethod
    def load(cls, folder: Path) -> Self | None:
        """Return that of a folder, None if there is none that can be read."""
        path = folder / MANIFEST
        try:
            plain = json.loads(read_text(path, str(path), StoreFormatError, limit=MOST_BYTES))
            key, rest, goals = plain["key"], plain["rest"], tuple(plain["goals"])
        except (StoreFormatError, ValueError, KeyError, TypeError, RecursionError):
            return None
        texts = (key, rest, *goals)
        return cls(key, rest, goals) if all(isinstance(text, str) for text in texts) else None


def with_goals(lowered: LoweredScene, goals: Sequence[int]) -> LoweredScene:
    """Return a scene with some of its goals."""
    return replace(lowered, arrays=arrays_of_goals(lowered.arrays, goals), goals=())


def arrays_of_goals(arrays: SceneArrays, goals: Sequence[int]) -> SceneArrays:
    """Return the arrays of a scene with some of its goals."""
    poses_of = [arrays.poses_of(goal) for goal in goals]
    some = np.array([pose for poses in poses_of for pose in poses], dtype=np.intp)
    first_pose = arrays.first_pose
    if first_pose.size:
        first_pose = np.cumsum([0, *map(len, poses_of)], dtype=np.int64)
    return arrays._replace(
        goal_R=arrays.goal_R[:, some],
        goal_p=arrays.goal_p[:, some],
        first_pose=first_pose,
        freedom=arrays.freedom[some] if len(arrays.freedom) else arrays.freedom,
    )


def _goal_digest(lowered: LoweredScene) -> str:
    """Return the hash of the only goal of a scene."""
    return hashlib.sha256(lowered.digest().encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Shared:
    """Blocks of other goals, of which some are the same."""

    kept: Kept
    """The blocks."""
    theirs: tuple[int, ...]
    """Numbers of the goals in common, in these blocks."""
    mine: tuple[int, ...]
    """Numbers of the same goals here, in the same order."""
    missing: tuple[int, ...]
    """Numbers of the other goals here."""

    @classmethod
    def found(cls, folder: Path, manifest: Manifest, kept: Kept) -> Self | None:
        """Return the blocks beside those of a manifest with most goals in common, None without any.

        Args:
            folder: Folder with the folders of blocks.
            manifest: That of the blocks to score.
            kept: Those blocks.
        """
        best: Self | None = None
        for path in sorted(folder.iterdir()):
            other = None if path == kept.blocks.folder else Manifest.load(path)
            if other is None or other.rest != manifest.rest:
                continue
            number = {goal: i for i, goal in enumerate(other.goals)}
            mine = tuple(i for i, goal in enumerate(manifest.goals) if goal in number)
            if mine and (best is None or len(mine) > len(best.mine)):
                theirs = tuple(number[manifest.goals[i]] for i in mine)
                blocks = replace(kept, blocks=Blocks(path, other.key), goals=len(other.goals))
                missing = tuple(i for i in range(len(manifest.goals)) if i not in mine)
                best = cls(blocks, theirs, mine, missing)
        return best

    def load(self, start: int, stop: int) -> Block | None:
        """Return the scores of the goals in common, None if there are none of these rows."""
        block = self.kept.load(start, stop)
        return None if block is None else _of_goals(block, self.theirs)


def _of_goals(block: Block, goals: Sequence[int]) -> Block:
    """Return the scores of some goals, in that order."""
    some = list(goals)
    number = _numbers(block)[:, some]
    return Block(
        block.reason[:, some],
        block.contact[:, some],
        block.dexterity[:, some],
        block.joints[number[number >= 0]],
    )


def joined(first: Block, second: Block, mine: Sequence[int]) -> Block:
    """Return the scores of all goals from those of some and of the others.

    Args:
        first: Scores of some goals.
        second: Scores of the others, in order.
        mine: Numbers of the first ones among all goals.
    """
    order = [*mine, *(g for g in range(len(mine) + second.reason.shape[1]) if g not in set(mine))]
    place = np.argsort(order)
    number = _numbers(second)
    number[number >= 0] += len(first.joints)
    both = np.concatenate([_numbers(first), number], axis=1)[:, place]
    return Block(
        np.concatenate([first.reason, second.reason], axis=1)[:, place],
        np.concatenate([first.contact, second.contact], axis=1)[:, place],
        np.concatenate([first.dexterity, second.dexterity], axis=1)[:, place],
        np.concatenate([first.joints, second.joints])[both[both >= 0]],
    )


def _numbers(block: Block) -> NDArray[np.int64]:
    """Return the row of the joints of each pair, -1 where it is not reached, shape (n, goals)."""
    reached = block.reason == Reason.REACHED
    return np.where(reached, np.cumsum(reached).reshape(reached.shape) - 1, -1)
