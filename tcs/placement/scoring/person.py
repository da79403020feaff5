"""For whom a file is scored, and goals that are too near to that body."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tcs.errors import StoreError
from tcs.model.scene import EnvironmentFile
from tcs.model.tasks import Task
from tcs.placement.store import PERSON
from tcs.placement.tables import Reason, ScoreTable

_log = logging.getLogger(__name__)


def person_entry(
    environment: EnvironmentFile, task: Task, tables: Sequence[ScoreTable]
) -> dict[str, Any]:
    """Return the entry of the metadata for a person who is not the papers' man as he sits or lies.

    It is {} for him.

    A goal at which the gripper touches the person is logged as a warning.

    Args:
        environment: The scored environment.
        task: The scored task.
        tables: The scores of its observed states.
    """
    person = environment.person
    if person is None or not (person.has_body or person.has_posture):
        return {}
    touching = _touching(f"{environment.person_model}::", tables)
    for goal, part in touching.items():
        _log.warning(
            "goal %s is too near to this person: the gripper touches %s in some or all states of "
            "the environment. Goals are moved with the skin, and not changed otherwise.",
            f"{goal + 1} ({name})" if (name := task.goals[goal].name) else goal + 1,
            part,
        )
    goals = [
        {"goal": goal, "name": task.goals[goal].name, "part": part}
        for goal, part in touching.items()
    ]
    return {PERSON: {**person.to_json(), "touching_goals": goals}}


def recorded_person(record: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return what is given of the person of a record, None for that of the environment.

    Args:
        record: Metadata of a score file, or a part of them.

    Raises:
        StoreError: If the entry is malformed.
    """
    if PERSON not in record:
        return None
    entry = record[PERSON]
    given = entry.get("given") if isinstance(entry, dict) else None
    if not isinstance(given, dict) or not all(isinstance(key, str) for key in given):
        raise StoreError(f"'{PERSON}' must hold what is given of the person under 'given'.")
    return given


def _touching(prefix: str, tables: Sequence[ScoreTable]) -> dict[int, str]:
    """Return the goals at which the gripper touches the person, with the part of the body."""
    found: dict[int, str] = {}
    for table in tables:
        blocked = table.reason == Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT
        for goal in np.flatnonzero(blocked.any(axis=0)).tolist():
            for pair in np.unique(table.pair[blocked[:, goal], goal]).tolist():
                part = table.pair_names[pair][1]
                if part.startswith(prefix):
                    found.setdefault(goal, part)
    return dict(sorted(found.items()))
