"""Plans of motions in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tcs.output.words.bodies import pair_text

NOT_DONE_TEXTS = {
    "unreached": "no posture reaches it",
    "rest_blocked": "something touches the robot while its arm rests",
    "approach_limits": "joint or velocity limits prevent its approach",
    "approach_blocked": "its approach is blocked",
    "no_path": "no path was found",
}
"""Why a goal is not done, by the reason in plans and motion files."""


def place_text(place: str | int) -> str:
    """Return the begin or end of a segment, as plans have it in JSON.

    >>> place_text("rest"), place_text(3)
    ('rest', 'goal 4')
    """
    return place if isinstance(place, str) else f"goal {place + 1}"


def not_done_text(goal: Mapping[str, Any]) -> str:
    """Return why a goal is not done, as one line.

    Args:
        goal: The result of a goal that is not done, as plans have it in JSON.
    """
    text = f"goal {goal['goal'] + 1}: {NOT_DONE_TEXTS[goal['reason']]}"
    if goal["segment"]:
        text += f" ({goal['segment']}, tried for {goal['seconds']:.2f} s)"
    if goal["pair"] is not None:
        text += f"; most often {pair_text(goal['pair'])}"
    return text
