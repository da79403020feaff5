"""What scoring a grid would take: time, memory and disk, estimated from some of its slices."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from tcs.files.compression import compress
from tcs.files.mapped import LEAST_BYTES
from tcs.kernel.problem import build_problem
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.blocks import BLOCK, Block
from tcs.placement.scoring.engines import SLICE, Part, Work
from tcs.placement.scoring.job import Job, whole_task
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.offline import ScoringSetup
from tcs.placement.scoring.scorer import Scorer

SAMPLES = 24
"""Slices that are scored, spread evenly over the grid. Environment states and base positions differ
in how many goals are near; 24 hit each part of the grids that ship."""

PAIR_BYTES = (1, 1, 2, 4)
"""Bytes of each pair of configuration and goal: reason, whether reached, bodies, dexterity."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """What scoring a grid would take."""

    task: str
    environment: str
    robot: str
    configurations: int
    goals: int
    blocks: int
    """Files of `--blocks`."""
    scoring_seconds: float
    """Time of the scoring alone [s], with approaches if they are scored, without compiling and
    sets."""
    scoring_seconds_error: float
    """Standard error of the time from the spread of the slices [s]."""
    memory_bytes: int
    """Memory of the scores, beside that of the program and of its scratch files."""
    scratch_bytes: int
    """Size of scratch files, to which scores beyond the memory are mapped."""
    disk_bytes: int
    """Size of the scores in a file or in blocks, without the sets."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return asdict(self)


def estimate(
    setups: Sequence[ScoringSetup],
    *,
    on_compile: Callable[[], None] | None = None,
    slices: int = SAMPLES,
) -> Estimate:
    """Estimate what scoring the jobs of some hands into one file would take.

    Args:
        setups: The job of each hand, with its scene; the time is that of one thread divided by
            their number of threads. Forbidden regions are not subtracted.
        on_compile: Called before the kernel compiles, if it has to.
        slices: Greatest number of slices to score.
    """
    found = []
    for setup in setups:
        job = setup.job
        lowered = job.lowered(setup.scene)
        problem = build_problem(lowered.arrays, setup.measure)
        is_scored = setup.approach.is_scored
        scorer = ApproachScorer(problem, approach_lines(job)) if is_scored else None
        warm_up(problem, on_compile, scorer)
        work = Work(Scorer.of(problem), lowered.grid)
        size = job.scored_grid.size
        starts = np.unique(np.linspace(0, max(0, size - SLICE), slices).astype(int))
        scored = [
            scored_slice(work, Part(start, min(start + SLICE, size)), scorer)
            for start in starts.tolist()
        ]
        found.append(estimate_from(job, scored, jobs=setup.jobs))
    sums = ("scoring_seconds", "memory_bytes", "scratch_bytes", "disk_bytes", "blocks")
    return replace(
        found[0],
        robot=setups[0].job.given_robot.name,
        goals=len(whole_task([setup.job for setup in setups]).goals),
        scoring_seconds_error=float(np.hypot.reduce([one.scoring_seconds_error for one in found])),
        **{name: sum(getattr(one, name) for one in found) for name in sums},
    )


class ScoredSlice(NamedTuple):
    """What scoring some configurations of a grid took."""

    configurations: int
    seconds: float
    """Processor time [s]."""
    joints_bytes: int
    """Size of the joint angles of the reached pairs."""
    disk_bytes: int
    """Size of the scores in a file."""


def scored_slice(work: Work, part: Part, approaches: ApproachScorer | None = None) -> ScoredSlice:
    """Score a part of a grid, with approaches if there is a scorer of them; return what it took."""
    begun = time.thread_time()
    block = work.score(part)
    if approaches is not None:
        block = block._replace(joints=approaches.score(work.grid, *block, jobs=1, first=part.start))
    seconds = time.thread_time() - begun
    return ScoredSlice(len(block.reason), seconds, block.joints.nbytes, _stored_bytes(block))


def estimate_from(job: Job, slices: Sequence[ScoredSlice], *, jobs: int) -> Estimate:
    """Estimate what scoring a job would take from some slices, of equal size, of such grids.

    Args:
        job: The job.
        slices: What scoring them took.
        jobs: Number of threads.
    """
    size, goals = job.scored_grid.size, len(job.task.goals)
    scored, _, joints, disk = (sum(values) for values in zip(*slices, strict=True))
    seconds = [one.seconds for one in slices]
    spread = float(np.std(seconds, ddof=1)) if len(seconds) > 1 else 0.0
    arrays = [size * goals * width for width in PAIR_BYTES]
    mapped = sum(array for array in arrays if array >= LEAST_BYTES)
    return Estimate(
        task=job.task.name,
        environment=job.spec.environment.name,
        robot=job.spec.robot.name,
        configurations=size,
        goals=goals,
        blocks=-(-size // BLOCK),
        scoring_seconds=sum(seconds) / scored * size / jobs,
        scoring_seconds_error=len(seconds) ** 0.5 * spread / scored * size / jobs,
        memory_bytes=sum(arrays) - mapped + round(joints / scored * size),
        scratch_bytes=mapped,
        disk_bytes=round(disk / scored * size),
    )


def _stored_bytes(block: Block) -> int:
    # Dexterity is stored where reached only.
    stored = (*block[:2], block.dexterity[block.reason == 0], block.joints)
    contacts = stored[1].astype(np.uint32)
    return sum(compress(array)["bytes"].size for array in (stored[0], contacts, *stored[2:]))
