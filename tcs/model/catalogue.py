"""The catalogue: names and titles of the tasks, environments and robots included in `tcs`.

Only headings are read. Checking a file against the models that it names takes seconds and is left
to the functions that load it. `kind_of` tells which of them that is.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel

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


def kind_of(reference: str) -> str | None:
    """Return what a model is: "task", "environment", "robot", "tool" or "person".

    Args:
        reference: Name of one that is included, or path of a YAML file, which is of the kind that
            knows most of its keys.

    Returns:
        The kind; None if it is neither a name that is included nor a YAML file.

    Raises:
        DataFileError: If the file cannot be read or its keys are of no kind.
    """
    # Imported here: `tcs list` needs none of them.
    from tcs.model.people import Person
    from tcs.model.robots import RobotFile, robot_names, tool_names
    from tcs.model.robots.held_tool import ToolFile
    from tcs.model.scene import EnvironmentFile, environment_names
    from tcs.model.tasks import task_names
    from tcs.model.tasks.task_files import TaskFile

    names = {
        "task": task_names(),
        "environment": environment_names(),
        "robot": robot_names(),
        "tool": tool_names(),
    }
    for kind, known in names.items():
        if reference in known:
            return kind
    if Path(reference).suffix not in (".yaml", ".yml"):
        return None
    models: dict[str, type[BaseModel]] = {
        "task": TaskFile,
        "environment": EnvironmentFile,
        "robot": RobotFile,
        "tool": ToolFile,
        "person": Person,
    }
    given = read_mapping(Path(reference), f"file '{reference}'", DataFileError, known=models).keys()
    fields = {
        kind: {*model.model_fields, *(field.alias for field in model.model_fields.values())}
        for kind, model in models.items()
    }
    # Of what is based on another one, files have as few keys as they like.
    counts = {kind: len(given & known) for kind, known in fields.items()}
    kind = max(counts, key=lambda one: counts[one])
    if not counts[kind]:
        raise DataFileError(
            f"file '{reference}' has no key of a task, an environment, a robot, a tool or a "
            f"person, but: {', '.join(map(str, given))}. See docs/adding.md."
        )
    return kind


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
