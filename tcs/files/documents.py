"""YAML files into checked values, and what is wrong with one in a single line."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Hashable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from tcs.errors import DataFileError, UnknownNameError

# Strict: in YAML `yes` is true, and true must not count as 1, nor the text '1' as a number.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
PositiveNumber = Annotated[Number, Field(gt=0)]
Length = Annotated[Number, Field(ge=0)]
Vector = tuple[Number, Number, Number]


class Document(BaseModel):
    """A mapping in a file: its keys are known, and it stays as it is."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Placed(Document):
    """Something that stands at a pose in a frame named elsewhere."""

    xyz: Vector = (0.0, 0.0, 0.0)
    """Position of its origin in that frame [m]."""
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw about that frame's fixed axes [deg]."""

    @property
    def rpy(self) -> Vector:
        """Roll, pitch, yaw about that frame's fixed axes [rad]."""
        roll, pitch, yaw = (math.radians(angle) for angle in self.rpy_deg)
        return roll, pitch, yaw


DocumentT = TypeVar("DocumentT", bound=Document)


def read_mapping(
    path: Path, where: str, error: type[DataFileError], *, known: Iterable[str]
) -> dict[str, Any]:
    """Return the keys and values of a YAML file.

    Args:
        path: The file.
        where: What to call it in a message, e.g. "task file 'shaving.yaml'".
        error: What to raise.
        known: Keys to name when there are none.

    Raises:
        DataFileError: As `error`, if it cannot be read, is no YAML, holds a key twice, or is no
            mapping.
    """
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except OSError as reason:
        raise error(f"{where} cannot be read: {reason.strerror}.") from reason
    except UnicodeDecodeError as reason:
        raise error(f"{where} is no text file in UTF-8.") from reason
    except yaml.YAMLError as reason:
        raise error(f"{where} is no sound YAML: {_yaml_complaint(reason)}.") from reason
    except ValueError as reason:
        # YAML lets them through: a month 13, a whole number of 5000 digits.
        raise error(f"{where} holds an impossible value: {reason}.") from reason
    if not isinstance(content, dict):
        raise error(f"{where} must hold keys and values: {', '.join(known)}.")
    return content


def checked(
    content: Mapping[str, Any],
    kind: type[DocumentT],
    where: str,
    error: type[DataFileError],
    *,
    also_known: Iterable[str] = (),
) -> DocumentT:
    """Return what keys and values stand for.

    Args:
        content: What a file holds.
        kind: What it has to hold.
        where: What to call it in a message.
        error: What to raise.
        also_known: Keys of the file that were taken out before.

    Raises:
        DataFileError: As `error`, if a value is missing or not what it has to be.
        UnknownNameError: If a key is not known.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as reason:
        raise _complaint(reason, kind, where, error, tuple(also_known)) from None


_KEY_TAGS = ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge")

# Values are quoted in messages of one line; a whole list of goals must not be.
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 60


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader without two of its silent surprises."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return a mapping, refusing a key that comes twice: PyYAML would drop the first."""
        seen = set()
        for key_node, _ in node.value:
            if key_node.tag not in _KEY_TAGS:
                raise yaml.constructor.ConstructorError(
                    problem="a key must be a word", problem_mark=key_node.start_mark
                )
            if key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    problem=f"key '{key_node.value}' is there twice",
                    problem_mark=key_node.start_mark,
                )
            seen.add(key_node.value)
        return super().construct_mapping(node, deep)


# PyYAML follows YAML 1.1, where 1e-3 is a text; YAML 1.2 and everybody's eyes read a number.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def _yaml_complaint(error: yaml.YAMLError) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
    return " ".join(str(error).split())


def _complaint(
    reason: ValidationError,
    kind: type[BaseModel],
    where: str,
    error: type[DataFileError],
    also_known: tuple[str, ...],
) -> DataFileError | UnknownNameError:
    """Return the first thing that is wrong, as an error of one line."""
    details = reason.errors(include_url=False)
    # A misspelt key also makes the right one missing; the misspelling is the one to name.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    first, location = details[0], list(details[0]["loc"])
    if first["type"] == "extra_forbidden":
        *holder, key = location
        known = _keys_at(kind, holder) + (() if holder else also_known)
        return UnknownNameError("key", str(key), known, where=_described(where, holder))
    text = f"{_described(where, location)}{_what_is_wrong(first)}"
    others = len(details) - 1
    return error(text + (f" ({others} more after this one.)" if others else ""))


def _what_is_wrong(detail: ErrorDetails) -> str:
    if detail["type"] == "missing":
        return " is missing."
    # The file's author wrote a list.
    said = detail["msg"].replace("tuple", "list").replace("Tuple", "List")
    if said.startswith("Value error, "):
        return f": {said.removeprefix('Value error, ')}."
    # The rest says "Input should be ...", or what else should: a list, its length, a text.
    must = said.removeprefix("Input should be ")
    must = f"must be {must}" if must != said else f"{said[0].lower()}{said[1:]}"
    return f" is {_SHORT.repr(detail['input'])}, but {must}."


def _described(where: str, location: list[int | str]) -> str:
    """Return a place in a file, e.g. "task file 'a.yaml', field 'goals[2].position'"."""
    if not location:
        return where
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return f"{where}, field '{''.join(parts).lstrip('.')}'"


def _keys_at(kind: type[BaseModel], location: list[int | str]) -> tuple[str, ...]:
    """Return the keys known to the document at a place in a document."""
    owner = kind
    for part in location:
        if isinstance(part, str) and part in owner.model_fields:
            owner = _document_inside(owner.model_fields[part].annotation) or owner
    return tuple(owner.model_fields)


def _document_inside(annotation: object) -> type[BaseModel] | None:
    """Return the document held by a type like list[Document] or dict[str, Document]."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = _document_inside(argument)
        if found is not None:
            return found
    return None
