"""Where the data that ships with `tcs` lies, and where it may keep what it computes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from tcs.errors import DataFileError, OutputError, UnknownNameError
from tcs.files.writing import make_folder

_PACKAGE = Path(__file__).resolve().parents[1]
_DATA_PARTS = ("models", "tasks")
_CACHE_VARIABLE = "TCS_CACHE_DIR"
CACHE_ADVICE = f"Set {_CACHE_VARIABLE} to a folder you may write to."
"""What to do when the cache cannot be written."""


def data_folder() -> Path:
    """Return the folder that holds `models/` and `tasks/`.

    In an installed wheel it is `tcs/_data`; in a checkout, the folder above the package.

    Raises:
        DataFileError: If neither place holds both folders.
    """
    return _data_folder_of(_PACKAGE)


def shipped_files(pattern: str) -> dict[str, Path]:
    """Return the data files that ship with `tcs`, by name, sorted.

    Args:
        pattern: Which ones, from the data folder, e.g. "models/robots/*.yaml".

    Raises:
        DataFileError: If there is no data folder.
    """
    files = {path.stem: path for path in data_folder().glob(pattern)}
    return dict(sorted(files.items()))


def named_file(
    kind: str,
    name_or_path: str | Path,
    shipped: Mapping[str, Path],
    *,
    beside: Path | None = None,
    where: str = "",
) -> Path:
    """Return the path of a data file.

    Args:
        kind: What is looked up, e.g. "robot".
        name_or_path: Name of a file that ships with `tcs`, or a path: anything that ends in
            `.yaml` or holds a path separator. Nothing checks that there is a file.
        shipped: The files that ship, by name.
        beside: Folder that a relative path starts from; None is the current one.
        where: Where the name stood, for the message.

    Raises:
        UnknownNameError: If no file of that name ships.
    """
    text = str(name_or_path)
    # Either separator: a path copied from another system is a path, not a name nobody knows.
    if isinstance(name_or_path, Path) or text.endswith(".yaml") or "/" in text or "\\" in text:
        return (beside or Path()) / Path(text).expanduser()
    if text not in shipped:
        raise UnknownNameError(kind, text, shipped, where=where)
    return shipped[text]


def cache_folder(*parts: str) -> Path:
    """Return the user's cache folder for `tcs`, or one inside it, made when it is not there yet.

    It is `$TCS_CACHE_DIR` if that is set, else `$XDG_CACHE_HOME/tcs`, else `~/.cache/tcs`.

    Args:
        parts: Names of the folder inside it, from the top.

    Raises:
        OutputError: If the folder cannot be made.
    """
    folder = _cache_place().joinpath(*parts)
    make_folder(folder, "cache folder", advice=CACHE_ADVICE)
    return folder


def _data_folder_of(package: Path) -> Path:
    """Return the data folder that belongs to the package installed at `package`."""
    # The wheel's own data comes first: site-packages may hold somebody else's `models/`.
    places = (package / "_data", package.parent)
    for place in places:
        if all((place / part).is_dir() for part in _DATA_PARTS):
            return place
    looked = " or ".join(f"'{place}'" for place in places)
    raise DataFileError(
        f"the data folders {' and '.join(_DATA_PARTS)} are not in {looked}. "
        "Install tcs again, or run it from a complete checkout."
    )


def _cache_place() -> Path:
    """Return where the cache belongs, without touching the disk."""
    chosen = os.environ.get(_CACHE_VARIABLE)
    if chosen:
        return Path(chosen).expanduser().absolute()
    base = os.environ.get("XDG_CACHE_HOME")
    # The XDG specification says that a relative path here is to be ignored.
    if base and Path(base).is_absolute():
        return Path(base) / "tcs"
    try:
        return Path.home() / ".cache" / "tcs"
    except RuntimeError as error:
        raise OutputError(
            f"no home folder is known for this user. Set {_CACHE_VARIABLE} to a writable folder."
        ) from error
