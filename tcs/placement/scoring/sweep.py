"""Scoring of a lowered scene: an engine scores the parts of its grid, then the approaches."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder, Blocks, opened_if
from tcs.files.mapped import chunks, large_zeros, release
from tcs.kernel.arrays import GridArrays
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.scores import JOINTS
from tcs.model.scene import LoweredScene
from tcs.placement.scoring import engines
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.scoring.blocks import (
    BLOCK,
    Block,
    Kept,
    Manifest,
    Shared,
    joined,
    key_of,
    with_goals,
)
from tcs.placement.scoring.engines import Part, ScoringEngine, Threads, Work
from tcs.placement.scoring.kernel_start import KernelStart, ik_of
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import ScoreTable

if TYPE_CHECKING:
    from tcs.kernel.approach.sweep import ApproachLines


READERS = 2
"""Threads that read kept blocks."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """The scores of a grid, and the time they took."""

    tables: tuple[ScoreTable, ...]
    """The scores, divided into the requested number of tables."""
    compile_seconds: float
    """Time to compile the kernel, or to load its machine code [s]."""
    scoring_seconds: float
    """Time of the scoring alone [s]."""
    ik: str
    """Inverse kinematics of the arm: ANALYTIC or NUMERIC."""
    approach_seconds: float = 0.0
    """Part of the scoring time that the approaches took [s]."""


def sweep(
    lowered: LoweredScene,
    weights: NDArray[np.float64],
    *,
    tables: int = 1,
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
    excluded: NDArray[np.bool_] | None = None,
    approaches: ApproachLines | None = None,
    blocks: BlockFolder | None = None,
    engine: ScoringEngine | None = None,
) -> Sweep:
    """Score every configuration of the grid against every goal.

    Args:
        lowered: The scene.
        weights: Weights of the goals, sum 1, shape (goals,).
        tables: Number of equal parts to divide the scores into, e.g. one for each observed state
            if the observed axes are the outermost of the grid.
        measure: Name of the dexterity measure, see `tcs.kernel.dexterity`.
        jobs: Number of threads; the scores do not depend on it.
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called first, if there is no cached machine code.
        excluded: Configurations that are not scored, shape (configurations,); None for none.
        approaches: The approaches of the goals, to score approachable postures only; None to score
            all postures.
        blocks: Folder to keep finished blocks of the grid in, and to take them from; None to keep
            none.
        engine: Who scores, without the approaches; None for `jobs` threads of this process.

    Returns:
        Scores, TCS eq. (1) to (4) per configuration, with a reason for every pair.

    Raises:
        UnknownNameError: If there is no measure of that name.
        TcsError: If `jobs` is less than 1, or the workers of the engine are lost.
        OutputError: If blocks cannot be kept in the folder, another process is at work there, or
            there is no room for a scratch file.
    """
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")
    problem = build_problem(lowered.arrays, measure)
    scorer = None if approaches is None else ApproachScorer(problem, approaches)
    start = KernelStart(lambda: [problem], on_compile, scorer)
    size, goals = lowered.grid.size, problem.goals.number
    begun = time.perf_counter()
    reason: NDArray[np.uint8] = large_zeros((size, goals), np.uint8)
    contact: NDArray[Any] = large_zeros((size, goals), _code_type(problem))
    dexterity: NDArray[np.float32] = large_zeros((size, goals), np.float32)
    joints = {}
    done = 0

    def work_of(some_goals: Sequence[int] | None) -> Work:
        start.ensure()
        of_goals = problem
        if some_goals is not None:
            arrays = with_goals(lowered, some_goals).arrays
            of_goals = build_problem(arrays, measure)
        return Work(Scorer.of(of_goals), lowered.grid, excluded)

    with (
        _opened(blocks, problem, lambda: Manifest.of(lowered, measure, excluded)) as found,
        closing(_scored(size, engine or Threads(jobs), found, work_of)) as parts,
    ):
        for part, block in parts:
            rows = slice(part.start, part.stop)
            reason[rows], contact[rows], dexterity[rows] = block[:3]
            joints[part] = block.joints
            done += part.stop - part.start
            for array in (reason, contact, dexterity):
                release(array)
            if on_progress is not None:
                on_progress(done, size)
    scores = GridScores(reason, contact, dexterity, joints)
    approach_begun, compiled = time.perf_counter(), start.seconds
    if scorer is None:
        winning = scores.winning
    else:
        winning = score_grid(
            scores,
            scorer,
            lowered.grid,
            jobs=jobs,
            ensure=start.ensure,
            blocks=blocks,
            key=lambda: key_of(lowered, measure, excluded),
            kept_of=lambda opened: _kept(opened, problem),
        )
    done_at = time.perf_counter()
    names = name_contacts(contact, lowered, problem)
    states = [slice(i * size // tables, (i + 1) * size // tables) for i in range(tables)]
    winners = np.cumsum([0, *(_reached(reason[rows]) for rows in states)])
    divided = tuple(
        ScoreTable(
            dexterity=dexterity[rows],
            reason=reason[rows],
            pair=contact[rows],
            pair_names=names,
            arm_joints=winning[winners[i] : winners[i + 1]],
            weights=np.asarray(weights, dtype=np.float64),
        )
        for i, rows in enumerate(states)
    )
    return Sweep(
        divided,
        start.seconds,
        scoring_seconds=done_at - begun - start.seconds,
        ik=ik_of(problem),
        approach_seconds=done_at - approach_begun - (start.seconds - compiled),
    )


class _Found(NamedTuple):
    """Blocks that are kept."""

    kept: Kept
    """Those of the goals, to which new ones are added."""
    shared: Shared | None
    """Those of other goals in the same scene, of which some are the same."""


@contextmanager
def _opened(
    blocks: BlockFolder | None, problem: Problem, manifest_of: Callable[[], Manifest]
) -> Iterator[_Found | None]:
    """Yield the blocks of a problem in a folder; None if none are to be kept."""
    if blocks is None:
        yield None
        return
    manifest = manifest_of()
    with blocks.opened(manifest.key) as opened:
        manifest.save(opened.folder)
        kept = _kept(opened, problem)
        shared = None if blocks.restart else Shared.found(blocks.path, manifest, kept)
        yield _Found(kept, shared)


def _kept(opened: Blocks, problem: Problem) -> Kept:
    """Return the blocks of a problem in their folder."""
    goals = problem.goals.number
    return Kept(opened, goals=goals, joints=JOINTS, contacts=_codes(problem))


def _scored(
    size: int,
    engine: ScoringEngine,
    found_blocks: _Found | None,
    work_of: Callable[[Sequence[int] | None], Work],
) -> Generator[tuple[Part, Block], None, None]:
    """Yield the scores of all parts of the grid, kept ones first, and keep the new ones.

    Args:
        size: Number of configurations.
        engine: Who scores.
        found_blocks: Blocks that are kept; None to keep none.
        work_of: Returns the grid with some of the goals, None for all; called if something has to
            be scored.
    """
    length = engine.length if found_blocks is None else BLOCK
    parts = [Part(start, min(start + length, size)) for start in range(0, size, length)]
    if found_blocks is None:
        yield from engine.scored(work_of(None), parts)
        return
    kept, shared = found_blocks
    missing = []
    # Threads, because most of the time goes into decompressing.
    found = Parallel(n_jobs=READERS, prefer="threads", return_as="generator")(
        delayed(kept.load)(*part) for part in parts
    )
    for part, block in zip(parts, found, strict=True):
        if block is None:
            missing.append(part)
        else:
            yield part, block
    if shared is not None:
        partly = [part for part in missing if shared.kept.has(part.start)]
        for part, block in _completed(shared, engine, partly, work_of):
            kept.save(part.start, block)
            missing.remove(part)
            yield part, block
    if not missing:
        return
    for part, block in engine.scored(work_of(None), missing):
        kept.save(part.start, block)
        yield part, block


def _completed(
    shared: Shared,
    engine: ScoringEngine,
    parts: Sequence[Part],
    work_of: Callable[[Sequence[int] | None], Work],
) -> Generator[tuple[Part, Block], None, None]:
    """Yield the scores of parts of which those of some goals are kept, but not of damaged ones."""
    if not shared.missing:
        for part in parts:
            if (block := shared.load(*part)) is not None:
                yield part, block
        return
    for part, others in engine.scored(work_of(shared.missing), parts):
        if (block := shared.load(*part)) is not None:
            yield part, joined(block, others, shared.mine)


def _reached(reason: NDArray[np.uint8]) -> int:
    """Return the number of reached pairs."""
    return sum(int(np.count_nonzero(reason[rows] == 0)) for rows in chunks(reason))


def _codes(problem: Problem) -> int:
    """Return the number of contact codes."""
    return int(problem.robot_bodies * (problem.environment.bodies + problem.robot_bodies))


def _code_type(problem: Problem) -> type[np.int16] | type[np.int32]:
    """Return the smaller type that has all contact codes and -1."""
    return np.int16 if _codes(problem) <= np.iinfo(np.int16).max else np.int32


def name_contacts(
    contact: NDArray[Any], lowered: LoweredScene, problem: Problem
) -> tuple[tuple[str, str], ...]:
    """Replace contact codes, in place, by indices into the returned pairs of names."""
    others = problem.environment.bodies + problem.robot_bodies
    both = (*lowered.environment_bodies, *lowered.robot_bodies)
    # One entry per code; NO_CONTACT (-1) indexes the last one.
    occurs = np.zeros(_codes(problem) + 1, dtype=np.bool_)
    for rows in chunks(contact):
        occurs[contact[rows]] = True
    codes = np.flatnonzero(occurs[:-1])
    index = np.full(occurs.size, -1, dtype=contact.dtype)
    index[codes] = np.arange(codes.size, dtype=contact.dtype)
    for rows in chunks(contact):
        contact[rows] = index[contact[rows]]
    return tuple((lowered.robot_bodies[code // others], both[code % others]) for code in codes)


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
