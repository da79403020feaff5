"""YAML into checked values, and what is wrong with it in one line."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Hashable
from pathlib import Path
from typing import Any, TypeVar, get_args

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from tcs.errors import TaskError, UnknownNameError


class Document(BaseModel):
    """A mapping in a file: its keys are known, its values are what they say, and it stays so."""

    # Strict: in YAML `yes` is true, and true must not count as 1.
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


DocumentT = TypeVar("DocumentT", bound=Document)


def read_document(path: Path, kind: type[DocumentT], what: str) -> DocumentT:
    """Return the content of a YAML file.

    Args:
        path: The file.
        kind: What it has to hold.
        what: What to call it in a message, e.g. "task file".

    Raises:
        TaskError: If it cannot be read, is no YAML, or holds something else.
        UnknownNameError: If a key is not known.
    """
    where = f"{what} '{path}'"
    try:
        content = yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except OSError as error:
        raise TaskError(f"{where} cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise TaskError(f"{where} is no text file in UTF-8.") from error
    except yaml.YAMLError as error:
        raise TaskError(f"{where} is no sound YAML: {_yaml_complaint(error)}.") from error
    except ValueError as error:
        # YAML lets them through: a month 13, a whole number of 5000 digits.
        raise TaskError(f"{where} holds an impossible value: {error}.") from error
    if not isinstance(content, dict):
        raise TaskError(f"{where} must hold keys and values: {', '.join(kind.model_fields)}.")
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise _complaint(error, kind, where) from None


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
    error: ValidationError, kind: type[BaseModel], where: str
) -> TaskError | UnknownNameError:
    """Return the first thing that is wrong, as an error of one line."""
    details = error.errors(include_url=False)
    # A misspelt key also makes the right one missing; the misspelling is the one to name.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    first, location = details[0], list(details[0]["loc"])
    if first["type"] == "extra_forbidden":
        holder = _described(where, location[:-1])
        return UnknownNameError("key", str(location[-1]), _keys_at(kind, location), where=holder)
    text = f"{_described(where, location)} {_what_is_wrong(first)}"
    others = len(details) - 1
    return TaskError(text + (f" ({others} more after this one.)" if others else ""))


def _what_is_wrong(detail: ErrorDetails) -> str:
    if detail["type"] == "missing":
        return "is missing."
    said = detail["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    return f"is {_SHORT.repr(detail['input'])}, but must be {said}."


def _described(where: str, location: list[int | str]) -> str:
    """Return a place in a file, e.g. "task file 'a.yaml', field 'goals[2].position'"."""
    if not location:
        return where
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return f"{where}, field '{''.join(parts).lstrip('.')}'"


def _keys_at(kind: type[BaseModel], location: list[int | str]) -> tuple[str, ...]:
    """Return the keys known to the document in which the last part of the location stands."""
    owner = kind
    for part in location[:-1]:
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
