"""Every error `tcs` raises on purpose.

    TcsError
    ├── UnknownNameError      a task, robot, environment or frame nobody has heard of
    ├── DataFileError         a file of ours or the user's that says something impossible
    │   ├── TaskError
    │   ├── RobotError
    │   │   └── ArmClassError     an arm the closed-form kernel cannot solve
    │   └── EnvironmentFileError
    ├── GridError             an empty or enormous grid of initial configurations
    ├── StoreError            a score file that cannot be used
    │   ├── StoreFormatError      truncated, foreign, or of an unknown version
    │   ├── UnsafeStoreError      a pickle that names something outside the allow-list
    │   └── StoreMismatchError    made from other models than today's
    ├── SelectionError        nothing to choose from, or a state that is not stored
    └── OutputError           a place that cannot be written

A goal that cannot be reached is a zero score, never an exception.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class TcsError(Exception):
    """Root of every error raised on purpose; its text is one line a user can act on."""


class UnknownNameError(TcsError):
    """A name that is not known where it was used."""

    def __init__(self, kind: str, name: str, known: Iterable[str], *, where: str = "") -> None:
        """Say what was asked for, what there is, and what was probably meant.

        Args:
            kind: What was looked up, e.g. "task".
            name: The name that was not found.
            known: Every name that would have been accepted.
            where: Where the name stood, e.g. "goal 3 of task 'shaving'".
        """
        self.kind = kind
        self.name = name
        self.known = tuple(sorted(known))
        self.where = where
        near = difflib.get_close_matches(name, self.known, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        prefix = f"{where}: " if where else ""
        listed = ", ".join(self.known) or "none"
        super().__init__(f"{prefix}unknown {kind} '{name}'. Known: {listed}.{hint}")


class DataFileError(TcsError):
    """A data file whose content cannot be used."""


class TaskError(DataFileError):
    """A task file whose content cannot be used."""


class RobotError(DataFileError):
    """A robot file, or the model it names, that cannot be used."""


class ArmClassError(RobotError):
    """An arm outside the class that the closed-form kernel solves."""


class EnvironmentFileError(DataFileError):
    """An environment file, or a model it names, that cannot be used."""


class GridError(TcsError):
    """A grid of initial configurations with no point, or with far too many."""


class StoreError(TcsError):
    """A score file that cannot be used."""


class StoreFormatError(StoreError):
    """A file that is truncated, foreign, or of an unknown version."""


class UnsafeStoreError(StoreError):
    """A file that asks the loader for something outside its allow-list."""


class StoreMismatchError(StoreError):
    """A file made from other models than the ones installed now."""


class SelectionError(TcsError):
    """A selection that has nothing to choose from."""


class OutputError(TcsError):
    """A place that cannot be written."""
