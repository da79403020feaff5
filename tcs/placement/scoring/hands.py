"""Scores of several hands in one file: each goal is reached by the best hand that it allows."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError
from tcs.files.mapped import chunks, large_zeros
from tcs.kernel.scores import NEARNESS, REACHED, Scores, new_scores
from tcs.model.robots import BOTH
from tcs.model.scene import SceneSpec
from tcs.model.tasks import partners
from tcs.placement.scoring.job import BARE, Job, whole_task
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC
from tcs.placement.scoring.together import Hands, together
from tcs.placement.store import ARMS, HANDS, OF_HAND, ScoreFile
from tcs.placement.tables import Reason, ScoreTable

if TYPE_CHECKING:
    from tcs.placement.scoring.offline import Scored, ScoringSetup


def serving_hands(
    reasons: Sequence[NDArray[np.uint8]],
    dexterity: Sequence[NDArray[np.float32]],
    goals: Sequence[Sequence[int]],
) -> NDArray[np.uint8]:
    """Return the hand that reaches each goal with the greatest dexterity, or comes nearest to it.

    Ties go to the first hand.

    Args:
        reasons: Reasons of each hand, shapes (n, goals of the hand).
        dexterity: Dexterity of each hand, 0 where not reached, of the same shapes.
        goals: Numbers of the goals of each hand, which together are 0, ..., G - 1.

    Returns:
        Numbers of hands, shape (n, G).
    """
    count = 1 + max(goal for numbers in goals for goal in numbers)
    hand = np.zeros((len(reasons[0]), count), np.uint8)
    nearest, best = np.full(hand.shape, -1, np.int16), np.zeros(hand.shape, np.float32)
    for number, columns in enumerate(map(list, goals)):
        near, value = NEARNESS[reasons[number]], dexterity[number]
        before, least = nearest[:, columns], best[:, columns]
        better = (near > before) | ((near == before) & (value > least))
        hand[:, columns] = np.where(better, np.uint8(number), hand[:, columns])
        nearest[:, columns] = np.where(better, near, before)
        best[:, columns] = np.where(better, value, least)
    return hand


class HandScores(NamedTuple):
    """Scores of configurations, each goal by the best hand that it allows."""

    scores: Scores
    """The scores; contact codes are those of the hand."""
    hand: NDArray[np.uint8]
    """Number of the hand, shape (n, G)."""


def best_of_hands(parts: Sequence[Scores], goals: Sequence[Sequence[int]]) -> HandScores:
    """Return the scores of the hand that serves each goal.

    Args:
        parts: The scores of each hand.
        goals: Numbers of the goals of each.
    """
    if len(parts) == 1:
        return HandScores(parts[0], np.zeros(parts[0].reason.shape, np.uint8))
    values = [np.where(part.reason == REACHED, part.dexterity, 0.0) for part in parts]
    hand = serving_hands([part.reason for part in parts], values, goals)
    found = new_scores(*hand.shape)
    for number, (part, columns) in enumerate(zip(parts, map(list, goals), strict=True)):
        row, column = np.nonzero(hand[:, columns] == number)
        to = row, np.array(columns)[column]
        found.reason[to], found.contact[to] = part.reason[row, column], part.contact[row, column]
        found.dexterity[to], found.joints[to] = (
            part.dexterity[row, column],
            part.joints[row, column],
        )
    return HandScores(found, hand)


def score_hands(
    setups: Sequence[ScoringSetup],
    *,
    begun: float,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> ScoreFile:
    """Score the goals of each hand, and return one file with all goals of each configuration.

    Args:
        setups: The job of each hand.
        begun: Start of the work, by `time.perf_counter` [s].
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.
        metadata: Further entries of the file's metadata.

    Raises:
        RobotError: If the arms have different grids: one has a torso joint, another has not.
    """
    jobs = [setup.job for setup in setups]
    for job in jobs:
        if job.grid != jobs[0].grid:
            raise RobotError(
                f"robots '{jobs[0].spec.robot.name}' and '{job.spec.robot.name}' have different "
                "torso joints, so no configuration serves the goals of both. Score them one by one."
            )
    size = jobs[0].scored_grid.size
    parts = [
        setup.scored(
            on_progress=_shifted(on_progress, number * size, len(setups) * size),
            on_compile=on_compile,
        )
        for number, setup in enumerate(setups)
    ]
    task = whole_task(jobs)
    numbers = [job.goal_numbers for job in jobs]
    states = [list(of_state) for of_state in zip(*(part.tables for part in parts), strict=True)]
    if any(partner is not None for partner in partners(task.goals)):
        built = [(setup.job, setup.job.lowered(setup.scene)) for setup in setups]
        hands = Hands.of(built, setups[0].measure)
        rows = jobs[0].grid.size
        states = [
            together(of_state, hands, first_row=state * rows, jobs=setups[0].jobs)
            for state, of_state in enumerate(states)
        ]
    tables = [joined(of_state, numbers, task.weights) for of_state in states]
    spec = SceneSpec(jobs[0].given_robot, jobs[0].spec.environment)
    whole = dataclasses.replace(jobs[0], task=task, spec=spec, hand=BARE, goal_numbers=())
    entries = {**_entries(jobs, parts), **(metadata or {})}
    return dataclasses.replace(setups[0], job=whole).file_of(tables, whole.grid, begun, entries)


def joined(
    tables: Sequence[ScoreTable],
    goals: Sequence[Sequence[int]],
    weights: NDArray[np.float64],
) -> ScoreTable:
    """Return the scores of all goals as one table, each by the best hand that it allows.

    Args:
        tables: The scores of each hand.
        goals: Numbers of the goals of each.
        weights: Weights of all goals, sum 1, shape (G,).
    """
    names = tuple(dict.fromkeys(pair for table in tables for pair in table.pair_names))
    number = {pair: i for i, pair in enumerate(names)}
    # The last entry stands for -1, no contact.
    renumbered = [
        np.array([*(number[pair] for pair in table.pair_names), -1], dtype=np.int32)
        for table in tables
    ]
    shape = tables[0].configurations, weights.size
    dexterity: NDArray[np.float32] = large_zeros(shape, np.float32)
    reason: NDArray[np.uint8] = large_zeros(shape, np.uint8)
    pair: NDArray[np.int32] = large_zeros(shape, np.int32)
    hand: NDArray[np.uint8] = large_zeros(shape, np.uint8)
    joints, done = [], [0] * len(tables)
    for rows in chunks(dexterity, reason, pair, hand):
        hand[rows] = serving_hands(
            [table.reason[rows] for table in tables],
            [table.dexterity[rows] for table in tables],
            goals,
        )
        of_rows = np.zeros((*hand[rows].shape, 7), np.float32)
        for k, (table, numbers) in enumerate(zip(tables, goals, strict=True)):
            for column, goal in enumerate(numbers):
                at = rows.start + np.flatnonzero(hand[rows, goal] == k)
                reason[at, goal] = table.reason[at, column]
                dexterity[at, goal] = table.dexterity[at, column]
                pair[at, goal] = renumbered[k][table.pair[at, column]]
            reached = table.reason[rows] == Reason.REACHED
            count = int(np.count_nonzero(reached))
            own = np.zeros((*reached.shape, 7), np.float32)
            own[reached] = table.arm_joints[done[k] : done[k] + count]
            done[k] += count
            columns = list(numbers)
            of_rows[:, columns] = np.where(
                (hand[rows][:, columns] == k)[..., None], own, of_rows[:, columns]
            )
        joints.append(of_rows[reason[rows] == Reason.REACHED])
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=pair,
        pair_names=names,
        arm_joints=np.concatenate(joints),
        weights=weights,
        hand=hand,
    )


def _entries(jobs: Sequence[Job], parts: Sequence[Scored]) -> dict[str, Any]:
    """Return the entries of the metadata: those of each hand, and what sums them up."""
    of_hands = [
        {
            **job.hand.to_json(),
            "goals": list(job.goal_numbers),
            "description": job.spec.robot.model_dump(mode="json"),
            **{key: part.entries[key] for key in OF_HAND if key in part.entries},
        }
        for job, part in zip(jobs, parts, strict=True)
    ]
    contacts = (entry["self_contact"] for entry in of_hands)
    timings = [part.entries["timings"] for part in parts]
    return {
        **{key: value for key, value in parts[0].entries.items() if key not in OF_HAND},
        **({ARMS: BOTH} if jobs[0].any_arm else {}),
        HANDS: of_hands,
        "scene_digest": digest_of_hands([entry["scene_digest"] for entry in of_hands]),
        "ik": NUMERIC if any(entry["ik"] == NUMERIC for entry in of_hands) else ANALYTIC,
        "self_contact": next((contact for contact in contacts if contact is not None), None),
        "timings": {key: sum(of_hand[key] for of_hand in timings) for key in timings[0]},
    }


def digest_of_hands(digests: Sequence[str]) -> str:
    """Return the digest of the scenes of all hands, given those of each."""
    return (
        digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
    )


def _shifted(
    on_progress: Callable[[int, int], None] | None, done: int, total: int
) -> Callable[[int, int], None] | None:
    """Return a report of progress that counts from `done` to `total`."""
    if on_progress is None:
        return None
    return lambda more, _: on_progress(done + more, total)
