"""What configurations reach for many people: the kernel evaluates these configurations alone."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import ArrayLike, NDArray

from tcs.errors import StoreFormatError, TcsError
from tcs.files.blocks import Blocks
from tcs.files.compression import compress, decompress
from tcs.kernel.arrays import FloatArray, IntArray, SceneArrays
from tcs.kernel.problem import (
    TOUCH,
    UNCHECKED,
    Problem,
    arm_order,
    build_problem,
    with_environment,
)
from tcs.kernel.rows import Rows
from tcs.kernel.shape_groups import with_group_rows
from tcs.model.people import Scale
from tcs.model.scene import PeopleInScene, SceneSpec
from tcs.model.tasks import load_task
from tcs.placement.robustness.body_collisions import counted_pairs, counted_rests
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.robustness.perturbed_scenes import HandScenes, PerturbedScenes, Run
from tcs.placement.robustness.trials import HandTrials, Progress, Trials
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.together import Hands
from tcs.placement.tables import Reason


class PersonProblems:
    """Problems of one robot in one environment, for one person after the other.

    Arranging the robot takes a hundred times as long as what a person changes.
    """

    def __init__(self, arrays: SceneArrays, measure: str) -> None:
        """Arrange the robot.

        Args:
            arrays: The scene with any person.
            measure: Name of the dexterity measure.
        """
        self._problem = problem = build_problem(arrays, measure)
        order = arm_order(arrays)
        self._pads = arrays.arm.pad[order], arrays.body.pad
        self._checked = arrays.arm_vs_environment[order], arrays.body_vs_environment
        self._groups = problem.links.groups, problem.body.groups
        self._margin = arrays.margin

    def of(self, arrays: SceneArrays) -> Problem:
        """Return the problem of a person.

        Args:
            arrays: The same scene with the person; only its environment and goals are read.
        """
        known, pad = self._problem.clearances, arrays.environment.pad
        widest = max(known.widest, 2.0 * float(pad.max(initial=0.0)))
        clearances = known._replace(
            environment=self._gaps(0, pad),
            base=self._gaps(1, pad),
            widest=widest,
            arm_radius=known.arm_radius + (widest - known.widest),
        )
        return with_environment(self._problem, arrays)._replace(clearances=clearances)

    def _gaps(self, group: int, pad: FloatArray) -> FloatArray:
        """Return the distances that arm (0) or body (1) keep from the environment [m]."""
        required = np.maximum(max(self._margin, TOUCH), self._pads[group][:, None] + pad)
        gaps = np.where(self._checked[group], required, UNCHECKED)
        return with_group_rows(np.ascontiguousarray(gaps), self._groups[group])


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
    if hand.job.paper:
        task = task.exact()
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
