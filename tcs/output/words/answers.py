"""Answers of `tcs score`, `tcs select` and `tcs explain` as plain containers, with their words.

The command line and the service return the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tcs.output.words.goals import goal_names
from tcs.output.words.numbers import percentage
from tcs.output.words.places import member_places, place_of_state
from tcs.placement import selection

if TYPE_CHECKING:
    from tcs.model.grid import InitialConfiguration
    from tcs.placement.reasons import Explanation
    from tcs.placement.store import ScoreFile


def choice_in_words(
    file: ScoreFile, choice: selection.Choice, here: InitialConfiguration | None
) -> dict[str, Any]:
    """Return a choice as plain containers.

    Args:
        file: The score file that it was selected from.
        choice: The choice.
        here: The current state that it was selected for, if that is known.

    Returns:
        What `Choice.to_json` returns; `here`, the current state or None; `here_place`, where the
        base is now relative to the person; and `places`, in each alternative too: where each
        member is, in the order of the tour. They are "" without a person. Of a set of several
        members also `gain`, what it gains by them.
    """
    table = choice.match.index if choice.match else 0
    result = {
        **choice.to_json(file.metadata["measure"]),
        "here": None if here is None else here.to_json(),
        "here_place": "" if here is None else place_of_state(file, table, here),
        "places": _places(file, choice),
        **({"gain": gain} if (gain := gain_text(choice)) else {}),
    }
    if choice.alternatives:
        result["alternatives"] = [
            {**one, "places": _places(file, other)}
            for one, other in zip(result["alternatives"], choice.alternatives, strict=True)
        ]
    return result


def basis_text(basis: str) -> str:
    """Return what kind of set was chosen, given `Choice.basis`.

    >>> basis_text("success")
    'most robust set'
    """
    return {
        "success": "most robust set",
        "goals": "most goals, then fewest stops",
        "utility": "greatest utility",
    }[basis]


def gain_text(choice: selection.Choice) -> str:
    """Return what a set of several stops gains over fewer; "" for one stop."""
    fewer = choice.fewer
    if fewer is None:
        return ""
    gains = []
    if choice.success is not None and fewer.success is not None:
        gains.append(("success under error", f"{choice.success:.1%}", f"{fewer.success:.1%}"))
    gains.append(("goals (P_R)", percentage(choice.reachability), percentage(fewer.reachability)))
    gains.append(("P_M", f"{choice.manipulability:.3f}", f"{fewer.manipulability:.3f}"))
    found = [
        f"{what} {after} instead of {before}" for what, after, before in gains if after != before
    ]
    gained = ", ".join(found) or "a gain below the last digit"
    return f"{len(choice.members)} stops instead of {len(fewer.members)}: {gained}"


def summary_in_words(file: ScoreFile, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the summary of a score file with the places of its best sets.

    Args:
        file: The score file.
        summary: Its main figures, of `tcs.placement.scoring.summary` and more.

    Returns:
        The same; `recommended`, the set that `tcs.select` recommends in the nominal state, as
        `choice_in_words`; None where no goal is reached; and in `best` and `best_single`, the sets
        with the greatest P_R + P_M, the `places` of the members relative to the person, "" without
        a person.
    """
    result, sets = dict(summary), file.nominal.sets
    result["recommended"] = None
    if len(sets.candidates):
        result["recommended"] = choice_in_words(file, selection.select(file), None)
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
