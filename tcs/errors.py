"""Exceptions of `tcs`.

    TcsError
    ├── UnknownNameError      an unknown name of a task, robot, environment, frame or key
    ├── DataFileError         a data file whose content cannot be used
    │   ├── TaskError
    │   ├── RobotError
    │   │   └── ArmClassError     an arm without a closed-form inverse kinematics
    │   └── EnvironmentFileError
    ├── GridError             a grid of initial configurations that is empty or too large
    ├── StoreError            a score file that cannot be used
    │   ├── StoreFormatError      truncated, of another program, or of an unknown version
    │   ├── UnsafeStoreError      a pickle that refers to a name outside the allow-list
    │   └── StoreMismatchError    made from models that have changed since
    ├── PerceptionError       scans in which no table is found, or that cannot be used
    ├── SelectionError        no set to choose from, or a state that is not stored
    ├── ServiceError          a request that the service refuses, or a server that does not answer
    │   ├── NotFoundError         a score file or job that the service does not hold
    │   ├── BusyError             a full queue; the same request may succeed later
    │   └── CancelledError        work that ended because it was cancelled
    └── OutputError           a file or folder that cannot be written

A goal that cannot be reached has a score of zero and raises no exception.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_MOST_LISTED = 40
"""Most known names that a message lists; of more it lists those most alike."""
_ALIKE = 10
"""Number of these."""


def one_line(text: str, most: int = 80) -> str:
    r"""Return a text from a file for a message: short, and without line breaks or control codes.

    >>> one_line("a\nb")
    'a b'
    """
    # `split` also splits at the separators of lines and paragraphs of Unicode.
    shown = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    return shown if len(shown) <= most else f"{shown[:most]}..."


class TcsError(Exception):
    """Base class of the exceptions of `tcs`; the message is one line on which a user can act."""


class UnknownNameError(TcsError):
    """A name that is unknown where it is used."""

    def __init__(self, what: str, name: str, known: Iterable[str], *, where: str = "") -> None:
        """Compose a message with the unknown name, the known names and the closest of them.

        Args:
            what: Type of the name, e.g. "task".
            name: The unknown name.
            known: The names that are accepted.
            where: Location of the name, e.g. "goal 3 of task 'shaving'".
        """
        self.what = what
        self.name = name
        self.known = tuple(sorted(known))
        self.where = where
        near = difflib.get_close_matches(name, self.known, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        prefix = f"{where}: " if where else ""
        listed = ", ".join(self.known) or "none"
        if len(self.known) > _MOST_LISTED:
            alike = difflib.get_close_matches(name, self.known, n=_ALIKE, cutoff=0.0)
            listed = f"{', '.join(sorted(alike))} and {len(self.known) - len(alike)} others"
        super().__init__(f"{prefix}unknown {what} '{one_line(name)}'. Known: {listed}.{hint}")


class DataFileError(TcsError):
    """A data file whose content cannot be used."""


class TaskError(DataFileError):
    """A task file whose content cannot be used."""


class RobotError(DataFileError):
    """A robot file, or the model it names, that cannot be used."""


class ArmClassError(RobotError):
    """An arm outside the classes with a closed-form inverse kinematics."""


class EnvironmentFileError(DataFileError):
    """An environment file, or a model it names, that cannot be used."""


class GridError(TcsError):
    """A grid of initial configurations without a point, or with too many."""


class StoreError(TcsError):
    """A score file that cannot be used."""


class StoreFormatError(StoreError):
    """A file that is truncated, of another program, or of an unknown version."""


class UnsafeStoreError(StoreError):
    """A file that refers to a name outside the allow-list of the reader."""


class StoreMismatchError(StoreError):
    """A file made from models that differ from the current ones."""


class PerceptionError(TcsError):
    """Scans in which no table is found, or that cannot be used."""


class SelectionError(TcsError):
    """A selection without a set to choose from, or in a state that is not stored."""


class OutputError(TcsError):
    """A file or folder that cannot be written."""


class ServiceError(TcsError):
    """A request that the service refuses, or a server that does not answer."""


class NotFoundError(ServiceError):
    """A score file or job that the service does not hold."""


class BusyError(ServiceError):
    """A full queue or too many requests at once; the same request may succeed later."""


class CancelledError(ServiceError):
    """Work that ended because it was cancelled."""
