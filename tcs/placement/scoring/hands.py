"""Scores of several hands in one file: each goal is reached by the best hand that it allows."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.files.mapped import chunks, large_zeros
from tcs.kernel.scores import NEARNESS, REACHED, Scores, new_scores
from tcs.placement.tables import Reason, ScoreTable


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


def digest_of_hands(digests: Sequence[str]) -> str:
    """Return the digest of the scenes of all hands, given those of each."""
    return (
        digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()
    )
