"""Answers of `tcs select` and `tcs explain` as plain containers, with their words.

The command line and the service return the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tcs.output.words.goals import goal_names
from tcs.output.words.places import member_places

if TYPE_CHECKING:
    from tcs.placement import selection
    from tcs.placement.reasons import Explanation
    from tcs.placement.store import ScoreFile


def choice_in_words(file: ScoreFile, choice: selection.Choice) -> dict[str, Any]:
    """Return a choice as plain containers.

    Args:
        file: The score file that it was selected from.
        choice: The choice.

    Returns:
        What `Choice.to_json` returns; and `places`: where each member is relative to the person, in
        the order of the tour, "" without a person.
    """
    places = member_places(
        file,
        choice.match.index if choice.match else 0,
        [choice.indices[i] for i in choice.order],
        [choice.members[i] for i in choice.order],
    )
    return {**choice.to_json(file.metadata["measure"]), "places": places}


def explanation_in_words(file: ScoreFile, explanation: Explanation) -> dict[str, Any]:
    """Return an explanation as plain containers.

    Args:
        file: The score file that is explained.
        explanation: The explanation.

    Returns:
        What `Explanation.to_json` returns; `measure`; `goal_names`, the names of all goals; and in
        `explained` and `nearest_reaching` the `place` of the base relative to the person.
    """
    result = {
        **explanation.to_json(),
        "measure": file.metadata["measure"],
        "goal_names": list(goal_names(file.task, file.tables[0].scores.goals)),
    }
    table = explanation.match.index
    for key, found in (("explained", explanation.explained), ("nearest_reaching", explanation.fix)):
        if found is not None:
            [place] = member_places(file, table, [found.index], [found.configuration])
            result[key] = {**result[key], "place": place}
    return result
