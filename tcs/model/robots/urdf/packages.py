"""Where a `package://` address lies on this machine."""

from __future__ import annotations

import importlib.metadata
import sys
from functools import cache
from pathlib import Path

from tcs.errors import RobotError

_SCHEME = "package://"


def resolve_uri(uri: str, beside: Path) -> Path:
    """Return the file that an address in a robot file or a URDF means.

    Args:
        uri: `package://<package>/<path>`, `file://<path>`, or a path.
        beside: Folder that relative paths start from; a package may also be one of the folders
            above it, which is how a URDF of one's own finds its meshes.

    Raises:
        RobotError: If the package is not installed, or the file is not there.
    """
    if uri.startswith(_SCHEME):
        package, _, inside = uri.removeprefix(_SCHEME).partition("/")
        path = _package_folder(package, beside, uri) / inside
    else:
        # An absolute path on the right replaces what stands left of it.
        path = beside / Path(uri.removeprefix("file://")).expanduser()
    if not path.is_file():
        raise RobotError(f"'{uri}': there is no file '{path}'.")
    return path


def _package_folder(package: str, beside: Path, uri: str) -> Path:
    """Return the folder of a package: above `beside`, or installed."""
    for folder in (beside, *beside.parents):
        if folder.name == package:
            return folder
    installed = _installed_folder(package)
    if installed is None:
        raise RobotError(
            f"'{uri}': package '{package}' is neither installed nor a folder above '{beside}'. "
            "Put the file that names it into that package's folder, or name a path from there."
        )
    return installed


@cache
def _installed_folder(package: str) -> Path | None:
    """Return `share/<package>` of an installed distribution, None if there is none."""
    # Robot descriptions built with cmeel hold no module to import: their data lies under
    # cmeel.prefix/share, listed in the distribution's record.
    marker = f"share/{package}/package.xml"
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.as_posix().endswith(marker):
            return Path(str(file.locate())).resolve().parent
    places = (Path(entry) / "cmeel.prefix" / "share" / package for entry in sys.path)
    return next((place for place in places if place.is_dir()), None)
