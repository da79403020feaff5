"""The catalogue: names and titles of the tasks, environments and robots included in `tcs`.

Only headings are read. Checking a file against the models that it names takes seconds and is left
to the functions that load it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tcs.errors import DataFileError
from tcs.files.documents import read_mapping
from tcs.files.paths import DataFiles, data_folder

_BASED_ON = "based_on"
"""Key of an environment file: the environment that supplies the keys this file lacks."""


def check_names(task: str | None, environment: str, robot: str) -> None:
    """Check that a task, an environment and a robot of these names are included.

    Args:
        task: Name of a task, None for one that is given otherwise.
        environment: Name of an environment.
        robot: Name of a robot.

    Raises:
        UnknownNameError: If one is not.
    """
    folders = ("task", "tasks/*/*.yaml"), ("environment", "models/beds_wheelchairs/*.yaml")
    names = (task, environment, robot)
    for name, (noun, pattern) in zip(
        names, (*folders, ("robot", "models/robots/*.yaml")), strict=True
    ):
        if name is not None:
            DataFiles(noun, pattern).path(name)


def catalogue() -> dict[str, list[dict[str, Any]]]:
    """Return the included tasks, environments and robots, each sorted by name.

    Raises:
        DataFileError: If an included file is damaged.
    """
    folder = data_folder()
    return {
        "tasks": [
            {
                "name": path.stem,
                "title": content["title"],
                "goals": len(content["goals"]),
                "environments": content["environments"],
            }
            for path, content in _files(
                folder / "tasks", "*/*.yaml", "title", "goals", "environments"
            )
        ],
        "environments": [
            {
                "name": path.stem,
                "title": content["title"],
                "origin": " ".join(content["origin"].split()),
            }
            for path, content in _files(
                folder / "models" / "beds_wheelchairs", "*.yaml", "title", "origin"
            )
        ],
        "robots": [
            {"name": path.stem, "title": content["title"]}
            for path, content in _files(folder / "models" / "robots", "*.yaml", "title")
        ],
    }


def _files(folder: Path, pattern: str, *keys: str) -> list[tuple[Path, dict[str, Any]]]:
    """Return the matching YAML files with their contents; each must have the keys."""
    found = []
    for path in sorted(folder.glob(pattern), key=lambda path: path.stem):
        try:
            content = _read(path, keys)
        except DataFileError as error:
            raise DataFileError(f"{error} Install tcs again.") from error
        if not all(key in content for key in keys):
            raise DataFileError(f"'{path}' lacks one of: {', '.join(keys)}. Install tcs again.")
        found.append((path, content))
    return found


def _read(path: Path, keys: tuple[str, ...]) -> dict[str, Any]:
    """Return the content of a file, merged over that of the file it is based on."""
    content = read_mapping(path, f"'{path}'", DataFileError, known=keys)
    if _BASED_ON not in content:
        return content
    return {**_read(path.with_name(f"{content[_BASED_ON]}.yaml"), keys), **content}
