"""Runs of trials in blocks: what was evaluated once is taken from a folder."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tcs.files.blocks import Blocks
from tcs.files.compression import compress, decompress
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.rows import Rows
from tcs.model.program import program_digest
from tcs.model.scene import LoweredScene
from tcs.placement.robustness.perturbed_scenes import PerturbedScenes, Run

if TYPE_CHECKING:
    from tcs.kernel.approach.sweep import ApproachLines

PAIRS = 20_000
"""Pairs of configuration and sample of a block: some seconds of work."""
PROBES = 8
"""States of the environment whose arrays are part of a block's name."""


def trials_key(
    hands: Iterable[tuple[LoweredScene, BoolArray, ApproachLines | None]], measure: str
) -> str:
    """Return the hash of what all trials follow from: program, scene and what counts in it.

    Args:
        hands: The scene of each hand as arrays, the pairs of shapes whose collisions count, and the
            approaches of the goals if they are scored.
        measure: Name of the dexterity measure.
    """
    sha = hashlib.sha256(f"trials\0{program_digest()}\0{measure}\0".encode())
    for lowered, pairs, lines in hands:
        sha.update(lowered.digest().encode() + np.packbits(pairs).tobytes())
        for values in () if lines is None else lines:
            sha.update(np.asarray(values, dtype="<f8").tobytes())
    return sha.hexdigest()


def states_digest(
    positions: Mapping[str, FloatArray], probe: Callable[[Mapping[str, FloatArray]], str]
) -> str:
    """Return the hash of an environment in several states.

    A joint that no state of the grid moves is not in the arrays of the grid. Some of the states are
    therefore hashed as the kernel sees them.

    Args:
        positions: Position of each joint [m or rad], shapes (states,).
        probe: Returns the hash of the arrays of some states, given by their positions.
    """
    sha = hashlib.sha256()
    for name, values in sorted(positions.items()):
        sha.update(f"{name}\0".encode() + np.asarray(values, dtype="<f8").tobytes())
    count = min(len(values) for values in positions.values())
    some = np.unique(np.linspace(0, count - 1, min(count, PROBES)).astype(np.int64))
    sha.update(probe({name: values[some] for name, values in positions.items()}).encode())
    return sha.hexdigest()


def kept_runs(
    blocks: Blocks,
    states: str,
    scenes: Callable[[], PerturbedScenes],
    poses: Rows,
    runs: Sequence[Run],
    jobs: int,
) -> Iterator[tuple[Run, BoolArray]]:
    """Yield the goals that each run reaches, as `PerturbedScenes.reached`, from blocks or new.

    Args:
        blocks: Where they are kept.
        states: Hash of the states of the environment, of `states_digest`.
        scenes: Returns these states; called if a block is missing.
        poses: The configurations.
        runs: Configurations and ranges of states.
        jobs: Number of threads.
    """
    built: PerturbedScenes | None = None
    for part in _grouped(runs):
        name = _name(states, poses, part)
        ends = np.cumsum([run.stop - run.start for run in part])
        found = blocks.load(name, partial(_decode, pairs=int(ends[-1])))
        if found is None:
            built = built or scenes()
            found = np.concatenate([reached for _, reached in built.reached(poses, part, jobs)])
            blocks.save(name, {"goals": found.shape[1], **_encode(found)})
        yield from zip(part, np.split(found, ends[:-1]), strict=True)


def _grouped(runs: Sequence[Run]) -> Iterator[list[Run]]:
    """Yield consecutive runs of some `PAIRS` pairs together."""
    part: list[Run] = []
    for run in runs:
        part.append(run)
        if sum(one.stop - one.start for one in part) >= PAIRS:
            yield part
            part = []
    if part:
        yield part


def _name(states: str, poses: Rows, runs: Sequence[Run]) -> str:
    """Return the name of the block of some runs."""
    rows = np.array([run.row for run in runs], dtype=np.int64)
    sha = hashlib.sha256(states.encode())
    for values in (poses.x, poses.y, poses.yaw):
        sha.update(np.asarray(values[rows], dtype="<f8").tobytes())
    whole = np.column_stack([poses.torso[rows], [run[1:] for run in runs]])
    sha.update(np.asarray(whole, dtype="<i8").tobytes())
    return sha.hexdigest()[:24]


def _encode(reached: BoolArray) -> dict[str, Any]:
    return {"reached": compress(np.packbits(reached))}


def _decode(content: dict[str, Any], pairs: int) -> BoolArray:
    goals = content.get("goals")
    size = pairs * (goals if type(goals) is int and 0 <= goals <= 2**20 else 0)
    packed = decompress(content, "reached", "u1", (-(-size // 8),))
    return np.unpackbits(packed, count=size).astype(np.bool_).reshape(pairs, -1)
