"""What configurations reach for many people: the kernel evaluates these configurations alone."""

from __future__ import annotations

import dataclasses
import hashlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import IntArray
from tcs.kernel.rows import Rows
from tcs.kernel.sweep import gripper_contacts
from tcs.model.people import Scale
from tcs.model.scene import PeopleInScene, SceneSpec
from tcs.model.tasks import load_task
from tcs.placement.population.kept_people import BLOCK, PROBES, KeptPeople
from tcs.placement.population.problems import PersonProblems
from tcs.placement.robustness.body_collisions import counted_pairs, counted_rests
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.robustness.perturbed_scenes import PerturbedScenes, Run
from tcs.placement.robustness.trials import ArmTrials, Progress, Trials

CHUNK = 500
"""People whose scenes are held in memory together: with errors, some ten megabytes for each state
of the environment."""
BATCH = 25
"""People that a thread evaluates at a time: enough that stretching their shapes together pays, and
an even load."""

Reasons = NDArray[np.uint8]


class _Prepared(NamedTuple):
    """One arm's scene for some people."""

    scenes: PeopleInScene
    problems: PersonProblems
    poses: Rows
    rows: IntArray
    """Rows of the configurations of this arm in the poses, shape (r,)."""
    place: IntArray
    """Number of the environment state of each of these, shape (r,)."""
    states: IntArray
    """Numbers of the states in which each person is, shape (people, s)."""


def for_papers_man(trials: Trials) -> Trials:
    """Return trials whose scenes hold the papers' man, whoever was scored."""
    arms = tuple(_with_papers_man(arm, trials) for arm in trials.arms)
    return dataclasses.replace(trials, arms=arms)


def reasons_for_people(
    trials: Trials,
    members: ArrayLike,
    scales: Sequence[dict[str, Scale]],
    offsets: Offsets | None = None,
    *,
    jobs: int = 2,
    on_progress: Progress = None,
) -> Reasons:
    """Return what becomes of each goal from each configuration, for each person.

    Args:
        trials: Trials with the papers' man.
        members: Flat configuration indices, shape (m,).
        scales: How the parts of each of N people are stretched.
        offsets: Errors of the environment's joints, one for each person, shapes (N,); None for no
            errors.
        jobs: Number of threads; the result does not depend on it.
        on_progress: Called with the number of people done and of all.

    Returns:
        A `Reason` for each configuration, person and goal, shape (m, N, goals).

    Raises:
        TcsError: If the number of threads is not positive.
    """
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")
    poses = trials.poses(members)
    found = np.empty((poses.state.size, len(scales), trials.weights.size), np.uint8)
    kept = _kept(trials, poses, scales, offsets)
    done = 0

    def step(people: int) -> None:
        nonlocal done
        done += people
        if on_progress is not None:
            on_progress(done, len(scales))

    for first in range(0, len(scales), CHUNK):
        columns = np.arange(first, min(first + CHUNK, len(scales)))
        missing = []
        for block in (columns[i : i + BLOCK] for i in range(0, columns.size, BLOCK)):
            before = None if kept is None else kept.load(block)
            if before is None:
                missing.append(block)
                continue
            found[:, block] = before
            step(block.size)
        if not missing:
            continue
        trials.start.ensure()
        prepared = list(_prepared(trials, poses, scales, columns, offsets))
        batches = [block[i : i + BATCH] for block in missing for i in range(0, block.size, BATCH)]
        parallel = Parallel(n_jobs=jobs, prefer="threads", return_as="generator")
        work = (delayed(_evaluated)(prepared, scales, batch, first) for batch in batches)
        for batch, reasons in zip(batches, parallel(work), strict=True):
            found[:, batch] = reasons
            if batch[-1] == missing[0][-1]:
                block = missing.pop(0)
                if kept is not None:
                    kept.save(block, found[:, block])
            step(batch.size)
    return found


def _kept(
    trials: Trials,
    poses: Rows,
    scales: Sequence[dict[str, Scale]],
    offsets: Offsets | None,
) -> KeptPeople | None:
    """Return the blocks of the configurations for the people; None if the trials keep none."""
    if trials.blocks is None or not scales:
        return None
    some = np.arange(min(PROBES, len(scales)))
    seen = hashlib.sha256()
    for arm in _prepared(trials, poses, scales, some, offsets):
        for arrays in arm.scenes.arrays_of([scales[i] for i in some.tolist()], arm.states):
            seen.update(
                dataclasses.replace(trials.arms[0].lowered, arrays=arrays).digest().encode()
            )
    return KeptPeople.of(
        trials.blocks, poses, scales, offsets, scenes=seen.hexdigest(), goals=trials.weights.size
    )


def _with_papers_man(arm: ArmTrials, trials: Trials) -> ArmTrials:
    """Return the robot in the environment with the papers' man in it."""
    spec = arm.job.spec
    if not spec.environment.has_body:
        return arm
    person = spec.environment.person
    assert person is not None
    environment = spec.environment.model_copy(update={"person": person.without_body()})
    task = load_task(trials.file.metadata["task"])
    job = dataclasses.replace(arm.job, task=task, spec=SceneSpec(spec.robot, environment))
    scene = job.scene()
    lowered = job.lowered(scene)
    pairs = counted_pairs(scene, lowered, trials.body_collisions)
    return ArmTrials(job, scene, counted_rests(lowered, trials.body_collisions), pairs)


def _prepared(
    trials: Trials,
    poses: Rows,
    scales: Sequence[dict[str, Scale]],
    columns: IntArray,
    offsets: Offsets | None,
) -> Iterator[_Prepared]:
    """Yield the scene of each arm that the configurations use, for some of the people."""
    states_of_arm = trials.grid.arm_size // trials.grid.state_size
    arm_of = poses.state // states_of_arm
    for number in np.unique(arm_of):
        arm = trials.arms[int(number)]
        rows = np.flatnonzero(arm_of == number)
        needed, place = np.unique(poses.state[rows], return_inverse=True)
        positions: list[dict[str, float]] = []
        states = []
        for state in needed.tolist():
            if offsets is None:
                states.append(np.full(columns.size, len(positions)))
                positions.append(trials.nominal(state))
                continue
            part = {name: values[columns] for name, values in offsets.items()}
            of_joints, _ = trials.positions(state, part)
            states.append(len(positions) + np.arange(columns.size))
            positions += [
                {name: float(values[i]) for name, values in of_joints.items()}
                for i in range(columns.size)
            ]
        scenes = PeopleInScene(arm.lowered, arm.scene, arm.job.task, positions)
        in_states = np.stack(states, axis=1)
        (arrays,) = scenes.arrays_of([scales[int(columns[0])]], in_states[:1])
        arrays = arrays._replace(body_vs_environment=arm.body_pairs[:, scenes.rows])
        problems = PersonProblems(arrays, str(trials.file.metadata["measure"]))
        yield _Prepared(scenes, problems, poses, rows, place, in_states)


def _evaluated(
    prepared: list[_Prepared],
    scales: Sequence[dict[str, Scale]],
    batch: IntArray,
    first: int,
) -> Reasons:
    """Return the reasons for some people, shape (configurations, people, goals).

    Args:
        prepared: The scenes of the arms, for the chunk of people.
        scales: Those of all people.
        batch: Numbers of the people.
        first: Number of the first person of the chunk.
    """
    people = [scales[person] for person in batch.tolist()]
    found: dict[int, list[NDArray[np.uint8]]] = defaultdict(list)
    for arm in prepared:
        for arrays in arm.scenes.arrays_of(people, arm.states[batch - first]):
            problem = arm.problems.of(arrays)
            scenes = PerturbedScenes(problem, gripper_contacts(problem))
            for row, place in zip(arm.rows.tolist(), arm.place.tolist(), strict=True):
                scores = scenes.scores(arm.poses, Run(row, place, place + 1))
                found[row].append(scores.reason[0])
    return np.array([found[row] for row in range(len(found))], dtype=np.uint8)
