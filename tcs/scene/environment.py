"""Environment files: furniture, person, the user's own obstacles, grid and error model, as data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from tcs.errors import EnvironmentFileError, UnknownNameError
from tcs.paths import data_folder
from tcs.space import Grid

FLOOR = "floor"
"""Name under which the floor is reported."""
BASED_ON = "based_on"
"""Key of a file that takes over whatever it does not say itself from another environment."""
WORLD = "world"
"""Name of the environment frame W as a parent."""

Number = Annotated[float, Field(allow_inf_nan=False)]
PositiveNumber = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Length = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")]


class _Data(BaseModel):
    """A frozen mapping of the file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class _Placed(_Data):
    """Something that stands at a pose in its parent's frame."""

    name: Name
    xyz: Vector = (0.0, 0.0, 0.0)
    """Position of its origin in the parent [m]."""
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw about the parent's fixed axes [deg]."""

    @property
    def rpy(self) -> Vector:
        """Roll, pitch, yaw about the parent's fixed axes [rad]."""
        roll, pitch, yaw = (math.radians(angle) for angle in self.rpy_deg)
        return roll, pitch, yaw


class ModelEntry(_Placed):
    """An SDFormat model that is part of the environment."""

    file: str
    parent: str = WORLD
    """Where its root link is fixed: "world" or "model::link"."""
    named_by: Literal["link", "collision"] = "collision"
    """What a blocked configuration is blamed on: the link, or the single collision shape."""


class Obstacle(_Placed):
    """An obstacle of the user's own: a box, or any SDFormat model, fixed to the world."""

    box: tuple[PositiveNumber, PositiveNumber, PositiveNumber] | None = None
    """Full sizes along its own x, y, z [m]."""
    file: str | None = None

    @model_validator(mode="after")
    def _is_box_or_file(self) -> Self:
        if (self.box is None) == (self.file is None):
            raise ValueError("give either 'box: [x, y, z]' or 'file: some.sdf'")
        return self


E = TypeVar("E", ModelEntry, Obstacle)


class JointError(_Data):
    """How far one joint of the environment may be from where the robot believes it is."""

    distribution: Literal["normal"]
    std: Length | None = None
    """Standard deviation of a sliding joint [m]."""
    std_deg: Length | None = None
    """Standard deviation of a turning joint [deg]."""

    @model_validator(mode="after")
    def _has_one_unit(self) -> Self:
        if (self.std is None) == (self.std_deg is None):
            raise ValueError("give either 'std' [m] or 'std_deg' [deg]")
        return self

    @property
    def standard_deviation(self) -> float:
        """Standard deviation [m or rad]."""
        return math.radians(self.std_deg) if self.std_deg is not None else float(self.std or 0.0)


class EnvironmentFile(_Data):
    """Everything that surrounds the robot, as its file says it."""

    name: Name
    title: str
    origin: str
    """Where the origin of W is and where its axes point, in words."""
    source: str
    models: tuple[ModelEntry, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    floor: bool = True
    """A floor at z = 0 that the arm must not touch; what stands on it is exempt."""
    joints: Mapping[str, Number] = {}
    """Joint positions that differ from 0 [m or rad]."""
    body_frames: Mapping[str, str] = {}
    """Names that goals use for parts of the person, each a "model::link"."""
    padding: Mapping[str, Length] = {}
    """How far the true surface may stand out of a link's shapes, by "model::link" [m]."""
    contact_margin: Length = 0.001
    """Contacts closer than this count as collision [m]."""
    grid: Mapping[str, Mapping[str, Any]]
    """Axes of the initial configurations, in the form that `Grid.from_spec` reads. An axis that is
    none of the robot's moves the joint of its name."""
    errors: Mapping[str, JointError] = {}
    """How far off each joint may be (Table II of the TCS paper)."""

    @model_validator(mode="after")
    def _names_are_distinct(self) -> Self:
        names = [WORLD, FLOOR]
        for entry in self.placed:
            if entry.name in names:
                raise ValueError(f"name '{entry.name}' is used twice or reserved; rename one")
            names.append(entry.name)
        return self

    @property
    def placed(self) -> tuple[ModelEntry | Obstacle, ...]:
        """Models, then obstacles."""
        return (*self.models, *self.obstacles)

    def __hash__(self) -> int:
        """Hash the content; pydantic's own hash stumbles over the mappings."""
        return hash(self.model_dump_json())


def environment_names() -> tuple[str, ...]:
    """Return the names of the environments that ship with `tcs`, sorted."""
    return tuple(sorted(path.stem for path in _folder().glob("*.yaml")))


def load_environment(name_or_path: str | Path) -> EnvironmentFile:
    """Return an environment, its model files resolved to absolute paths.

    Args:
        name_or_path: One of `environment_names()`, or the path of a file: anything that ends in
            `.yaml` or holds a path separator. Files it names are looked for beside it, then in
            the data folder.

    Raises:
        UnknownNameError: If no environment has that name.
        EnvironmentFileError: If the file cannot be read or says something impossible.
        GridError: If its grid is none.

    >>> load_environment("wheelchair").body_frames["head"]
    'person::head_center'
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or _is_path(text):
        return _read(Path(text).expanduser().absolute())
    if text not in environment_names():
        raise UnknownNameError("environment", text, environment_names())
    return _read(_folder() / f"{text}.yaml")


def _folder() -> Path:
    return data_folder() / "models" / "beds_wheelchairs"


def _read(path: Path, above: tuple[Path, ...] = ()) -> EnvironmentFile:
    """Return the environment of a file; `above` are the files that are based on it."""
    content = _content(path)
    base = content.pop(BASED_ON, None)
    if base is not None:
        content = {**_base(str(base), path, above).model_dump(), **content}
    try:
        environment = EnvironmentFile.model_validate(content)
    except ValidationError as error:
        raise EnvironmentFileError(_one_line(path, error)) from error
    # Only to refuse a bad grid here, where the file's name can be given.
    Grid.from_spec(environment.grid, where=f"environment file '{path}', field 'grid'")
    return _with_files_resolved(environment, path)


def _content(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise EnvironmentFileError(
            f"environment file '{path}' cannot be read: {error.strerror}."
        ) from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        reason = " ".join(str(error).split())
        raise EnvironmentFileError(f"environment file '{path}' is not YAML: {reason}") from error
    if not isinstance(content, dict):
        raise EnvironmentFileError(
            f"environment file '{path}' must be a mapping. "
            f"Known keys: {', '.join(_known_keys([]))}."
        )
    return content


def _base(name_or_path: str, path: Path, above: tuple[Path, ...]) -> EnvironmentFile:
    """Return the environment that the file at `path` is based on."""
    chain = (*above, path)
    if _is_path(name_or_path):
        base = (path.parent / Path(name_or_path).expanduser()).absolute()
    elif name_or_path in environment_names():
        base = _folder() / f"{name_or_path}.yaml"
    else:
        where = f"environment file '{path}', field '{BASED_ON}'"
        raise UnknownNameError("environment", name_or_path, environment_names(), where=where)
    if base.resolve() in [file.resolve() for file in chain]:
        raise EnvironmentFileError(
            f"environment file '{path}', field '{BASED_ON}': '{name_or_path}' is based on this "
            "file in turn. Name another one."
        )
    return _read(base, chain)


def _is_path(text: str) -> bool:
    return text.endswith(".yaml") or "/" in text or "\\" in text


def _one_line(path: Path, error: ValidationError) -> str:
    """Return the first complaint as one line: file, field, what is wrong, what is allowed."""
    complaints = error.errors()
    first = complaints[0]
    location = [str(part) for part in first["loc"]]
    field = ".".join(location)
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "extra_forbidden":
        message = f"unknown key. Known: {', '.join(_known_keys(location))}"
    where = f", field '{field}'" if field else ""
    more = f" ({len(complaints) - 1} more after this)" if len(complaints) > 1 else ""
    return f"environment file '{path}'{where}: {message}.{more}"


def _known_keys(location: list[str]) -> tuple[str, ...]:
    """Return the keys that are known where an unknown one was found."""
    nested: dict[str, type[_Data]] = {
        "models": ModelEntry,
        "obstacles": Obstacle,
        "errors": JointError,
    }
    owner = nested.get(location[0], EnvironmentFile) if len(location) > 1 else EnvironmentFile
    known = tuple(owner.model_fields)
    return (*known, BASED_ON) if owner is EnvironmentFile else known


def _with_files_resolved(environment: EnvironmentFile, path: Path) -> EnvironmentFile:
    def resolved(entry: E, field: str) -> E:
        if entry.file is None:
            return entry
        places = (path.parent, _folder(), data_folder())
        for place in places:
            candidate = (place / Path(entry.file).expanduser()).resolve()
            if candidate.is_file():
                return entry.model_copy(update={"file": str(candidate)})
        looked = ", ".join(f"'{place}'" for place in places)
        raise EnvironmentFileError(
            f"environment file '{path}', field '{field}.file': '{entry.file}' is in none of "
            f"{looked}. Give a path from the file's own folder, or an absolute one."
        )

    models = tuple(resolved(m, f"models.{i}") for i, m in enumerate(environment.models))
    obstacles = tuple(resolved(o, f"obstacles.{i}") for i, o in enumerate(environment.obstacles))
    return environment.model_copy(update={"models": models, "obstacles": obstacles})
