"""Answers of `tcs score`, `tcs select` and `tcs explain` as plain containers, with their words.

The command line and the service return the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tcs.output.words.goals import goal_names
from tcs.output.words.places import member_places, place_of_state

if TYPE_CHECKING:
    from tcs.model.grid import InitialConfiguration
    from tcs.placement import selection
    from tcs.placement.reasons import Explanation
    from tcs.placement.store import ScoreFile


def choice_in_words(
    file: ScoreFile, choice: selection.Choice, here: InitialConfiguration
) -> dict[str, Any]:
    """Return a choice as plain containers.

    Args:
        file: The score file that it was selected from.
        choice: The choice.
        here: The current state that it was selected for.

    Returns:
        What `Choice.to_json` returns; `here_place`, where the base is now relative to the person;
        and `places`, in each alternative too: where each member is, in the order of the tour. They
        are "" without a person.
    """
    result = {
        **choice.to_json(file.metadata["measure"]),
        "here_place": place_of_state(file, choice.match.index if choice.match else 0, here),
        "places": _places(file, choice),
    }
    if choice.alternatives:
        result["alternatives"] = [
            {**one, "places": _places(file, other)}
            for one, other in zip(result["alternatives"], choice.alternatives, strict=True)
        ]
    return result


def summary_in_words(file: ScoreFile, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary of a score file with the places of its best sets.

    Args:
        file: The score file.
        summary: Its main figures, of `tcs.placement.scoring.summary` and more.

    Returns:
        The same, and in `best` and `best_single` the `places` of the members relative to the
        person, "" without a person.
    """
    result, sets = dict(summary), file.nominal.sets
    for key, members in (("best", sets.best), ("best_single", sets.best_single)):
        if result[key] is not None:
            places = member_places(file, file.nominal_index, members)
            result[key] = {**result[key], "places": places}
    return result


def _places(file: ScoreFile, choice: selection.Choice) -> list[str]:
    """Return where each member of a choice is relative to the person, in the order of the tour."""
    return member_places(
        file,
        choice.match.index if choice.match else 0,
        [choice.indices[i] for i in choice.order],
        [choice.members[i] for i in choice.order],
    )


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
