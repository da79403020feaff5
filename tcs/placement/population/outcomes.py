"""What configurations reach for many people: the kernel evaluates these configurations alone."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import IntArray, SceneArrays
from tcs.kernel.rows import Rows
from tcs.model.people import Scale
from tcs.model.scene import PeopleInScene, SceneSpec
from tcs.model.tasks import load_task
from tcs.placement.population.kept_people import BLOCK, PROBES, KeptPeople
from tcs.placement.population.problems import PersonProblems
from tcs.placement.robustness.body_collisions import counted_pairs, counted_rests
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.robustness.perturbed_scenes import HandScenes, PerturbedScenes, Run
from tcs.placement.robustness.trials import HandTrials, Progress, Trials
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.together import Hands

CHUNK = 500
"""People whose scenes are held in memory together: with errors, some ten megabytes for each state
of the environment."""
BATCH = 25
"""People that a thread evaluates at a time: enough that stretching their shapes together pays, and
an even load."""

Reasons = NDArray[np.uint8]


class _Prepared(NamedTuple):
    """The scene of one hand for some people."""

    scenes: PeopleInScene
    problems: PersonProblems
    goals: tuple[int, ...]
    """Numbers of the goals that the hand may serve."""
    poses: Rows
    place: IntArray
    """Number of the environment state of each configuration, shape (m,)."""
    states: IntArray
    """Numbers of the states in which each person is, shape (people, s)."""


def for_papers_man(trials: Trials) -> Trials:
    """Return trials whose scenes hold the papers' man, whoever was scored."""
    hands = tuple(_with_papers_man(hand, trials) for hand in trials.hands)
    return dataclasses.replace(trials, hands=hands)


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
        work = (
            delayed(_evaluated)(prepared, scales, batch, first, trials.together)
            for batch in batches
        )
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
    for hand in _prepared(trials, poses, scales, some, offsets):
        for arrays in hand.scenes.arrays_of([scales[i] for i in some.tolist()], hand.states):
            seen.update(
                dataclasses.replace(trials.hands[0].lowered, arrays=arrays).digest().encode()
            )
    return KeptPeople.of(
        trials.blocks, poses, scales, offsets, scenes=seen.hexdigest(), goals=trials.weights.size
    )


def _with_papers_man(hand: HandTrials, trials: Trials) -> HandTrials:
    """Return the robot with a hand in the environment with the papers' man in it."""
    spec = hand.job.spec
    if not spec.environment.has_body:
        return hand
    person = spec.environment.person
    assert person is not None
    environment = spec.environment.model_copy(update={"person": person.without_body()})
    task = load_task(trials.file.metadata["task"])
    if len(trials.hands) > 1:
        goals = tuple(task.goals[goal] for goal in hand.goals)
        task = dataclasses.replace(hand.job.task, goals=goals)
    job = dataclasses.replace(hand.job, task=task, spec=SceneSpec(spec.robot, environment))
    scene = job.scene()
    lowered = job.lowered(scene)
    pairs = counted_pairs(scene, lowered, trials.body_collisions)
    rests = counted_rests(lowered, trials.body_collisions)
    return HandTrials(job, scene, rests, pairs, hand.goals)


def _prepared(
    trials: Trials,
    poses: Rows,
    scales: Sequence[dict[str, Scale]],
    columns: IntArray,
    offsets: Offsets | None,
) -> Iterator[_Prepared]:
    """Yield the scene of each hand, for some of the people."""
    needed, place = np.unique(poses.state, return_inverse=True)
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
    in_states = np.stack(states, axis=1)
    for hand in trials.hands:
        scenes = PeopleInScene(hand.lowered, hand.scene, hand.job.task, positions)
        (arrays,) = scenes.arrays_of([scales[int(columns[0])]], in_states[:1])
        arrays = arrays._replace(body_vs_environment=hand.body_pairs[:, scenes.rows])
        problems = PersonProblems(arrays, str(trials.file.metadata["measure"]))
        yield _Prepared(scenes, problems, hand.goals, poses, place.ravel(), in_states)


def _evaluated(
    prepared: list[_Prepared],
    scales: Sequence[dict[str, Scale]],
    batch: IntArray,
    first: int,
    together: Hands,
) -> Reasons:
    """Return the reasons for some people, shape (configurations, people, goals).

    Args:
        prepared: The scenes of the hands, for the chunk of people.
        scales: Those of all people.
        batch: Numbers of the people.
        first: Number of the first person of the chunk.
        together: The hands, to check arms that work at the same time against each other.
    """
    people = [scales[person] for person in batch.tolist()]
    found: list[list[NDArray[np.uint8]]] = [[] for _ in prepared[0].place]
    arrays_of_hands = (
        hand.scenes.arrays_of(people, hand.states[batch - first]) for hand in prepared
    )
    for of_person in zip(*arrays_of_hands, strict=True):
        scenes = PerturbedScenes(tuple(map(_hand_scenes, prepared, of_person)), together)
        for row, place in enumerate(prepared[0].place.tolist()):
            scores, _ = scenes.scores(prepared[0].poses, Run(row, place, place + 1))
            found[row].append(scores.reason[0])
    return np.array(found, dtype=np.uint8)


def _hand_scenes(hand: _Prepared, arrays: SceneArrays) -> HandScenes:
    """Return the states of one person's scene for one hand."""
    return HandScenes(Scorer.of(hand.problems.of(arrays)), hand.goals)
