"""Where the data that ships with `tcs` lies, and where it may keep what it computes."""

from __future__ import annotations

import os
from pathlib import Path

from tcs.errors import DataFileError, OutputError

_PACKAGE = Path(__file__).resolve().parent
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


def cache_folder(*parts: str) -> Path:
    """Return the user's cache folder for `tcs`, or one inside it, made when it is not there yet.

    It is `$TCS_CACHE_DIR` if that is set, else `$XDG_CACHE_HOME/tcs`, else `~/.cache/tcs`.

    Args:
        parts: Names of the folder inside it, from the top.

    Raises:
        OutputError: If the folder cannot be made.
    """
    folder = _cache_place().joinpath(*parts)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cache folder '{folder}' cannot be made: {error.strerror}. {CACHE_ADVICE}"
        ) from error
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
