"""Paths: data files that ship with `tcs` or belong to the user, and the cache folder."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from tcs.errors import DataFileError, OutputError, TcsError, UnknownNameError
from tcs.files.writing import make_folder

_PACKAGE = Path(__file__).resolve().parents[1]
_DATA_PARTS = ("models", "tasks")
_CACHE_VARIABLE = "TCS_CACHE_DIR"
CACHE_ADVICE = f"Set {_CACHE_VARIABLE} to a folder you may write to."
"""Advice for messages about a cache that cannot be written."""


def data_folder() -> Path:
    """Return the folder that contains `models/` and `tasks/`.

    In an installed wheel it is `tcs/_data`; in a checkout, the folder above the package.

    Raises:
        DataFileError: If neither contains both folders.
    """
    return _data_folder_of(_PACKAGE)


@dataclass(frozen=True)
class DataFiles:
    """Data files of one type: those that ship with `tcs`, and those of the user.

    Attributes:
        noun: Type of the files in messages, e.g. "robot".
        pattern: Glob pattern of the files that ship, relative to the data folder, e.g.
            "models/robots/*.yaml".
    """

    noun: str
    pattern: str

    def shipped(self) -> dict[str, Path]:
        """Return the files that ship with `tcs` by name, sorted.

        Raises:
            DataFileError: If there is no data folder.
        """
        files = {path.stem: path for path in data_folder().glob(self.pattern)}
        return dict(sorted(files.items()))

    def names(self) -> tuple[str, ...]:
        """Return the names of the files that ship with `tcs`, sorted."""
        return tuple(self.shipped())

    def path(
        self, name_or_path: str | Path, *, beside: Path | None = None, where: str = ""
    ) -> Path:
        """Return the path of a file.

        Args:
            name_or_path: Name of a file that ships with `tcs`, or a path: a text that ends in
                `.yaml` or contains a path separator. The file at a path need not exist.
            beside: Folder that a relative path starts from; None is the current folder.
            where: Location of the name, for messages.

        Raises:
            UnknownNameError: If no file of that name ships.
            DataFileError: If the path starts at the home folder of an unknown user.
        """
        text = str(name_or_path)
        if isinstance(name_or_path, Path) or is_path(text):
            what = f"{where}: {self.noun} file" if where else f"{self.noun} file"
            return (beside or Path()) / expanded(text, what, DataFileError)
        shipped = self.shipped()
        if text not in shipped:
            raise UnknownNameError(self.noun, text, shipped, where=where)
        return shipped[text]


def is_path(text: str) -> bool:
    """Return whether a text is the path of a data file, not the name of one that ships."""
    # Either separator: a path copied from another system is still a path, not a name.
    return text.endswith(".yaml") or "/" in text or "\\" in text


def expanded(path: str, what: str, error: type[TcsError]) -> Path:
    """Return a path with a leading `~` or `~user` replaced by that user's home folder.

    Args:
        path: The path.
        what: Its name in messages.
        error: Class of the error to raise.

    Raises:
        TcsError: As `error`, if the home folder is unknown, or the path holds a NUL byte.
    """
    if "\0" in path:
        raise error(f"{what} {path!r} contains a NUL byte. Write the path without it.")
    try:
        return Path(path).expanduser()
    except RuntimeError:
        user = Path(path).parts[0]
        raise error(
            f"{what} '{path}': the home folder '{user}' is unknown. Give the full path."
        ) from None


def data_reference(given: object, name: str) -> str:
    """Return the reference by which a data file can be loaded again: its name or absolute path.

    Args:
        given: The argument by which it was loaded: a name, a path, or the loaded object.
        name: The name that the file contains.
    """
    if isinstance(given, Path) or (isinstance(given, str) and given != name):
        return str(expanded(str(given), "file", DataFileError).absolute())
    return name


def cache_folder(*parts: str) -> Path:
    """Return the user's cache folder for `tcs`, or a folder inside it; create it when missing.

    It is `$TCS_CACHE_DIR` if that is set, else `$XDG_CACHE_HOME/tcs`, else `~/.cache/tcs`.

    Args:
        parts: Names of the folder inside it, from the top.

    Raises:
        OutputError: If the folder cannot be created.
    """
    folder = _cache_path().joinpath(*parts)
    make_folder(folder, "cache folder", advice=CACHE_ADVICE)
    return folder


def _data_folder_of(package: Path) -> Path:
    """Return the data folder that belongs to the package installed at `package`."""
    # The data of the wheel comes first: site-packages may hold the `models/` of another package.
    candidates = (package / "_data", package.parent)
    for folder in candidates:
        if all(os.path.isdir(folder / part) for part in _DATA_PARTS):
            return folder
    searched = " or ".join(f"'{folder}'" for folder in candidates)
    raise DataFileError(
        f"the data folders {' and '.join(_DATA_PARTS)} are not in {searched}. "
        "Install tcs again, or run it from a complete checkout."
    )


def _cache_path() -> Path:
    """Return the path of the cache folder, without touching the disk."""
    chosen = os.environ.get(_CACHE_VARIABLE)
    if chosen:
        return expanded(chosen, _CACHE_VARIABLE, OutputError).absolute()
    base = os.environ.get("XDG_CACHE_HOME")
    # The XDG specification requires that a relative path is ignored.
    if base and Path(base).is_absolute():
        return Path(base) / "tcs"
    try:
        return Path.home() / ".cache" / "tcs"
    except RuntimeError as error:
        raise OutputError(
            f"no home folder is known for this user. Set {_CACHE_VARIABLE} to a writable folder."
        ) from error
