"""Environment files: furniture, person, the user's own obstacles, grid and error model."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import Field, model_validator

from tcs.errors import EnvironmentFileError, GridError
from tcs.files.documents import (
    Clearance,
    Document,
    Entries,
    JointPosition,
    Placed,
    Size,
    checked,
    read_mapping,
)
from tcs.files.paths import DataFiles, data_folder, expanded
from tcs.files.unchanged import kept_while_unchanged
from tcs.model.grid import Axis, Grid
from tcs.model.people import JOINTS, Person, PersonEntry, PersonLike, load_person
from tcs.model.scene.environment.error_distribution import ErrorDistribution
from tcs.model.scene.environment.furniture import BedEntry, WheelchairEntry
from tcs.model.scene.environment.model_files import CLOUDS, MESHES
from tcs.model.scene.mounting import FurnitureMount
from tcs.model.scene.person.posture import Posture

FLOOR = "floor"
"""Name under which the floor is reported."""
BASED_ON = "based_on"
"""Key that names another environment, which supplies the keys that this file lacks."""
WORLD = "world"
"""Name of the environment frame W as a parent."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")]


class _NamedEntry(Placed):
    """A named object with a pose in its parent's frame."""

    name: Name


class ModelEntry(_NamedEntry):
    """An SDFormat model that is part of the environment."""

    file: str
    parent: str = WORLD
    """Parent of its root link: "world" or "model::link"."""
    named_by: Literal["link", "collision"] = "collision"
    """Name under which contacts are reported: the link's, or the single collision shape's."""


class Obstacle(_NamedEntry):
    """An obstacle of the user's own, fixed to the world: a shape, a file of one, or a model."""

    box: tuple[Size, Size, Size] | None = None
    """Full sizes along its own x, y, z [m]."""
    sphere: Size | None = None
    """Radius [m]."""
    cylinder: tuple[Size, Size] | None = None
    """Radius, and length along its own z [m]."""
    capsule: tuple[Size, Size] | None = None
    """Radius, and length between the centres of its caps along its own z [m]."""
    file: str | None = None
    """An SDFormat or URDF model, a mesh, or a point cloud."""
    scale: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    """Metres per unit of a mesh or a point cloud; None is 1."""
    protrusion: Annotated[float, Field(ge=0.002, le=0.2)] | None = None
    """Distance by which the shapes around a mesh may protrude from it [m]; None is 0.01."""
    cell: Annotated[float, Field(ge=0.005, le=1.0)] | None = None
    """Edge of the cells of a point cloud [m]; a cell with a point is solid. None is 0.03."""

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        given = [key for key in SHAPES if getattr(self, key) is not None]
        if len(given) != 1:
            raise ValueError(
                f"give one of {', '.join(SHAPES)}, not {' and '.join(given) or 'none'}"
            )
        # What a PLY file holds is known once it is found; `obstacle_shapes` checks its options.
        unknown = self.file is not None and Path(self.file).suffix.lower() == _EITHER
        allowed = tuple(_OPTION_OF) if unknown else _OPTIONS.get(self.type, ())
        for key in ("scale", "protrusion", "cell"):
            if getattr(self, key) is not None and key not in allowed:
                raise ValueError(f"{key} is for {_OPTION_OF[key]}")
        return self

    @property
    def type(self) -> str:
        """What it is: the name of a shape, or "model", "mesh" or "cloud" for a file."""
        if self.file is None:
            return next(key for key in SHAPES if getattr(self, key) is not None)
        suffix = Path(self.file).suffix.lower()
        if suffix == _EITHER:
            return "mesh" if _has_faces(Path(self.file)) else "cloud"
        if suffix in MESHES:
            return "mesh"
        return "cloud" if suffix in CLOUDS else "model"


SHAPES = ("box", "sphere", "cylinder", "capsule", "file")
_HEADER = 65_536
"""Most bytes of the header of a PLY file."""
_EITHER = ".ply"
"""Type of files that hold a mesh or a point cloud."""
_OPTIONS = {"mesh": ("scale", "protrusion"), "cloud": ("scale", "cell")}
_OPTION_OF = {
    "scale": f"meshes ({', '.join(MESHES)}) and point clouds ({', '.join(CLOUDS)})",
    "protrusion": f"meshes ({', '.join(MESHES)})",
    "cell": f"point clouds ({', '.join(CLOUDS)})",
}


@kept_while_unchanged(files=64)
def _has_faces(file: Path) -> bool:
    """Return whether a PLY file holds faces; not if it cannot be read, which its reader reports."""
    try:
        with open(file, "rb") as stream:
            head = stream.read(_HEADER).split(b"end_header", maxsplit=1)[0]
    except OSError:
        return False
    found = re.search(rb"^element\s+(?:face|tristrips)\s+(\d+)", head, re.MULTILINE)
    return found is not None and int(found[1]) > 0


E = TypeVar("E", ModelEntry, Obstacle)


class EnvironmentFile(Document):
    """Content of an environment file: everything that surrounds the robot."""

    name: Name
    title: str
    origin: str
    """Description of the origin and the axes of W."""
    source: str
    models: Annotated[tuple[ModelEntry, ...], Entries] = ()
    person: PersonEntry | None = None
    """Name of the model that is the person, or whose body they have; without a name it is the model
    named "person", if there is one. All other models are furniture, also those with body frames."""
    wheelchair: WheelchairEntry | None = None
    """Sizes of the model named "wheelchair", or the name of a preset."""
    bed: BedEntry | None = None
    """Sizes of the model named "bed", or the name of a preset."""
    obstacles: Annotated[tuple[Obstacle, ...], Entries] = ()
    mount: FurnitureMount | None = None
    """Where the robot is bolted to furniture; None for a robot on the floor."""
    floor: bool = True
    """Whether there is a floor at z = 0; the arm must not touch it, the rest of the robot may."""
    joints: Annotated[Mapping[str, JointPosition], Entries] = {}
    """Joint positions that differ from 0 [m or rad]."""
    posture: Annotated[Mapping[str, Posture], Entries] = {}
    """For each leading joint, e.g. a head rest, the positions of the joints that follow it."""
    body_frames: Annotated[Mapping[str, str], Entries] = {}
    """Frames that goals may be fixed to, e.g. parts of the person: name and "model::link", the name
    of an obstacle, or "world"."""
    padding: Annotated[Mapping[str, Clearance], Entries] = {}
    """Greatest distance by which the true surface may exceed the shapes of a link, by "model::link"
    [m]."""
    contact_margin: Clearance = 0.001
    """Least clearance: shapes closer than this collide [m]."""
    grid: Mapping[str, Mapping[str, Any]]
    """Axes of the initial configurations, in the form that `Grid.from_spec` reads. An axis other
    than the robot's moves the joint of its name."""
    observed: Mapping[str, Mapping[str, Any]] = {}
    """Axes that the robot observes but cannot choose, in the same form: the task is scored at each
    value of the joint of that name."""
    errors: Annotated[Mapping[str, ErrorDistribution], Entries] = {}
    """Error distribution of each joint (Table II of the TCS paper)."""

    @model_validator(mode="after")
    def _names_are_distinct(self) -> Self:
        names = [WORLD, FLOOR]
        for entry in self.placed:
            if entry.name in names:
                raise ValueError(f"name '{entry.name}' is used twice or reserved; rename one")
            names.append(entry.name)
        return self

    @model_validator(mode="after")
    def _person_is_a_model(self) -> Self:
        known = [model.name for model in self.models]
        if self.person is not None and self.person_model not in known:
            raise ValueError(
                f"person: no model is named '{self.person_model}'; there are "
                f"{', '.join(known) or 'none'}"
            )
        return self

    @model_validator(mode="after")
    def _sizes_are_of_models(self) -> Self:
        known = [model.name for model in self.models]
        for name in ("wheelchair", "bed"):
            if getattr(self, name) is not None and name not in known:
                raise ValueError(
                    f"{name}: no model is named '{name}'; there are {', '.join(known) or 'none'}"
                )
        return self

    @model_validator(mode="after")
    def _a_joint_follows_one_other(self) -> Self:
        leader_of: dict[str, str] = {}
        for leader, posture in self.posture.items():
            for name in posture.joints:
                if name in self.posture:
                    raise ValueError(f"posture: '{name}' follows '{leader}' and leads others")
                if name in leader_of:
                    both = f"'{leader_of[name]}' and '{leader}'"
                    raise ValueError(f"posture: '{name}' follows {both}; it can follow one")
                leader_of[name] = leader
        for field in ("joints", "errors", "grid", "observed"):
            for name in getattr(self, field):
                if name in leader_of:
                    raise ValueError(
                        f"{field}: '{name}' follows '{leader_of[name]}', so it cannot be set "
                        "itself; remove it here or under 'posture'"
                    )
        return self

    @property
    def observed_axes(self) -> tuple[Axis, ...]:
        """The axes under `observed`, in the order of the file."""
        return tuple(
            Axis.from_dict({**plain, "name": name}) for name, plain in self.observed.items()
        )

    @property
    def observable_axes(self) -> tuple[Axis, ...]:
        """Axes with the name and the unit of each joint that may be observed.

        Joints with an error distribution come first, then the observed axes.
        """
        perturbed = [
            Axis(name, "m" if error.std_deg is None else "deg", 0.0, 0.0, 1)
            for name, error in self.errors.items()
        ]
        return (*perturbed, *self.observed_axes)

    @property
    def placed(self) -> tuple[ModelEntry | Obstacle, ...]:
        """Models, then obstacles."""
        return (*self.models, *self.obstacles)

    @property
    def person_model(self) -> str:
        """Name of the model that is the person, if there is one."""
        return (self.person.model if self.person else None) or "person"

    @property
    def has_body(self) -> bool:
        """Whether the person is resized to a body other than that of the model's file."""
        return self.person is not None and self.person.has_body

    def is_person(self, model: str) -> bool:
        """Return whether the model of that name is the person, rather than furniture."""
        return model == self.person_model and any(m.name == model for m in self.models)

    def __hash__(self) -> int:
        """Return a hash of the content; pydantic's own hash fails on mappings."""
        return hash(self.model_dump_json())


EMPTY_ENVIRONMENT = EnvironmentFile(
    name="empty",
    title="Empty space",
    origin="the robot's base",
    source="none: there is nothing in it",
    floor=False,
    grid={},
)
"""An environment without any object, not even a floor."""


ENVIRONMENTS = DataFiles("environment", "models/beds_wheelchairs/*.yaml")


def environment_names() -> tuple[str, ...]:
    """Return the names of the environments that ship with `tcs`, sorted."""
    return ENVIRONMENTS.names()


def load_environment(name_or_path: str | Path) -> EnvironmentFile:
    """Return an environment, its model files resolved to absolute paths.

    Args:
        name_or_path: One of `environment_names()`, or the path of a file: a text that ends in
            `.yaml` or contains a path separator. Files that it names are searched for beside it,
            then in the data folder.

    Raises:
        UnknownNameError: If no environment has that name, or a key in the file is unknown.
        EnvironmentFileError: If the file cannot be read or its content is invalid.
        GridError: If its grid or an observed axis is invalid.

    >>> load_environment("wheelchair").body_frames["head"]
    'person::head_center'
    """
    return _read(ENVIRONMENTS.path(name_or_path).absolute())


def with_person(environment: EnvironmentFile, person: PersonLike) -> EnvironmentFile:
    """Return an environment with another person.

    Args:
        environment: An environment with a person.
        person: As for `tcs.model.people.load_person`.

    Raises:
        EnvironmentFileError: If there is no person in the environment.
        TcsError: As `tcs.model.people.load_person`.
    """
    found = load_person(person)
    model = found.model or environment.person_model
    if not any(entry.name == model for entry in environment.models):
        raise EnvironmentFileError(
            f"environment '{environment.name}' has no model '{model}', so there is no person to "
            "resize. Name the model with the key 'model' of the person."
        )
    changed = environment.model_copy(update={"person": found.model_copy(update={"model": model})})
    _check_ranges(changed, f"environment '{environment.name}'")
    return changed


def _folder() -> Path:
    return data_folder() / "models" / "beds_wheelchairs"


def _read(path: Path, above: tuple[Path, ...] = ()) -> EnvironmentFile:
    """Return the environment of a file; `above` are the files that are based on it."""
    where = f"environment file '{path}'"
    known = (*EnvironmentFile.model_fields, BASED_ON)
    content = read_mapping(path, where, EnvironmentFileError, known=known)
    base = content.pop(BASED_ON, None)
    if base is not None:
        content = {**_base(str(base), path, above).model_dump(), **content}
    environment = checked(
        content, EnvironmentFile, where, EnvironmentFileError, also_known=(BASED_ON,)
    )
    # Only to raise for an invalid grid here, where the message can name the file.
    Grid.from_spec(environment.grid, where=f"{where}, field 'grid'")
    if environment.person is not None:
        environment.person.check_posture(f"{where}, field 'person'")
        if environment.has_body:
            environment.person.body(f"{where}, field 'person'")
    _check_ranges(environment, where)
    _check_observed(environment, where=f"{where}, field 'observed'")
    return _with_files_resolved(environment, path)


def _check_ranges(environment: EnvironmentFile, where: str) -> None:
    """Check that the person can move their joints to all angles that the environment names.

    Raises:
        DataFileError: If one is out of the person's range of motion.
    """
    person = environment.person or Person()
    if environment.wheelchair is not None:
        here = f"{where}, field 'wheelchair.back_angle_deg': 'trunk_flexion'"
        person.check_angle("trunk_flexion", -environment.wheelchair.back_angle_deg, here)
    for name, position in environment.joints.items():
        if name in JOINTS:
            person.check_angle(name, math.degrees(position), f"{where}, field 'joints': '{name}'")
    for field in ("grid", "observed"):
        for name, plain in getattr(environment, field).items():
            if name in JOINTS:
                here = f"{where}, field '{field}': '{name}'"
                values = Axis.from_dict({**plain, "name": name}, where=here).values
                for value in (values[0], values[-1]):
                    person.check_angle(name, math.degrees(float(value)), here)


def _check_observed(environment: EnvironmentFile, where: str) -> None:
    """Check that observed axes are valid, and that none is also in the grid."""
    for name, plain in environment.observed.items():
        Axis.from_dict({**plain, "name": name}, where=where)
        if name in environment.grid:
            raise GridError(
                f"{where}: axis '{name}' is also in 'grid'. The robot either chooses it ('grid') "
                "or observes it ('observed'): remove it from one of them."
            )


def _base(name_or_path: str, path: Path, above: tuple[Path, ...]) -> EnvironmentFile:
    """Return the environment that the file at `path` inherits from."""
    chain = (*above, path)
    where = f"environment file '{path}', field '{BASED_ON}'"
    base = ENVIRONMENTS.path(name_or_path, beside=path.parent, where=where)
    base = base.absolute()
    if os.path.realpath(base) in [os.path.realpath(file) for file in chain]:
        raise EnvironmentFileError(
            f"{where}: '{name_or_path}' is based on this file in turn. Name another one."
        )
    return _read(base, chain)


def _with_files_resolved(environment: EnvironmentFile, path: Path) -> EnvironmentFile:
    def resolved(entry: E, field: str) -> E:
        if entry.file is None:
            return entry
        file = expanded(
            entry.file, f"environment file '{path}', field '{field}.file'", EnvironmentFileError
        )
        places = (path.parent, _folder(), data_folder())
        for place in places:
            candidate = Path(os.path.realpath(place / file))
            if os.path.isfile(candidate):
                return entry.model_copy(update={"file": str(candidate)})
        looked = ", ".join(f"'{place}'" for place in places)
        raise EnvironmentFileError(
            f"environment file '{path}', field '{field}.file': '{entry.file}' is in none of "
            f"{looked}. Give a path from the file's own folder, or an absolute one."
        )

    models = tuple(resolved(m, f"models[{i}]") for i, m in enumerate(environment.models))
    obstacles = tuple(resolved(o, f"obstacles[{i}]") for i, o in enumerate(environment.obstacles))
    return environment.model_copy(update={"models": models, "obstacles": obstacles})
