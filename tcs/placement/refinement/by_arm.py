"""Why an arm of several does not reach a goal: the file has the scores of the best one."""

from __future__ import annotations

import dataclasses

import numpy as np

from tcs.errors import SelectionError, UnknownNameError
from tcs.placement.reasons import Explanation
from tcs.placement.reasons.fix import with_hand
from tcs.placement.refinement.points import PointScorer
from tcs.placement.tables import Reason


def explained_by_arm(explanation: Explanation, arm: str) -> Explanation:
    """Return an explanation with the outcome by a certain arm, worked out by the kernel.

    Args:
        explanation: The explanation, by the best hand.
        arm: Name of the arm.

    Raises:
        SelectionError: If the file is of one hand.
        UnknownNameError: If no hand that the goal allows is of that arm.
        StoreMismatchError: If the models are not those the file was made from.
    """
    file, goal, explained = explanation.file, explanation.goal, explanation.explained
    if not file.hands:
        raise SelectionError(f"The file has one arm only, so there is no arm '{arm}' to choose.")
    allowed = {
        entry["arm"]: number for number, entry in enumerate(file.hands) if goal in entry["goals"]
    }
    if arm not in allowed:
        raise UnknownNameError("arm", arm, allowed, where=f"goal {goal + 1}")
    hand = allowed[arm]
    if explained is None or hand == explained.hand:
        return explanation
    values = file.configurations.values([explained.index])
    point = np.array([[values[axis.name][0] for axis in file.configurations.axes]])
    table = explanation.match.index
    scores = PointScorer.of(file, table, 1).of_hand(hand).score_table(point)
    column = file.goals_of_hands[hand].index(goal)
    pair = int(scores.pair[0, column])
    by_arm = dataclasses.replace(
        explained,
        reason=Reason(scores.reason[0, column]),
        pair=scores.pair_names[pair] if pair >= 0 else None,
        dexterity=float(scores.dexterity[0, column]),
        hand=hand,
    )
    fix = with_hand(file, file.tables[table].scores, goal, explanation.fix, by_arm)
    return dataclasses.replace(explanation, explained=by_arm, fix=fix)
