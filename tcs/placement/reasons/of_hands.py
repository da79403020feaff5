"""The hand of a fix, where it is another one than that which is explained."""

from __future__ import annotations

import dataclasses

from tcs.placement.reasons.explained import ExplainedConfiguration
from tcs.placement.reasons.fix import Fix
from tcs.placement.store import ScoreFile
from tcs.placement.tables import ScoreTable


def with_hand(
    file: ScoreFile, scores: ScoreTable, goal: int, fix: Fix | None, asked: ExplainedConfiguration
) -> Fix | None:
    """Return the fix with the hand to use, if it is another one than the explained one."""
    if fix is None or scores.hand is None or scores.hand[fix.index, goal] == asked.hand:
        return fix
    entry = file.hands[int(scores.hand[fix.index, goal])]
    arm = f"{entry['arm']} arm" if entry["arm"] else "bare hand"
    return dataclasses.replace(fix, hand=" with ".join(filter(None, (arm, entry["tool"]))))
