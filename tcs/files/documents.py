"""YAML documents: reading, validation against a model, and one-line errors that name the field."""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Hashable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from tcs.errors import DataFileError, UnknownNameError, one_line
from tcs.files import quantities
from tcs.files.quantities import UNIT_TOLERANCE, Quantity
from tcs.files.reading import read_text


def _within(quantity: Quantity) -> AfterValidator:
    """Return a validator that refuses numbers out of the range of a quantity."""

    def check(value: float) -> float:
        fault = quantity.fault(value)
        if fault is not None:
            raise PydanticCustomError("out_of_range", "{fault}", {"fault": fault})
        return value

    return AfterValidator(check)


# Strict: in YAML `yes` is true, and true must not count as 1, nor the text '1' as a number.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number that is no physical quantity; one that is has a type below."""
Position = Annotated[Number, _within(quantities.POSITION)]
Size = Annotated[Number, _within(quantities.SIZE)]
Clearance = Annotated[Number, _within(quantities.CLEARANCE)]
Deviation = Annotated[Number, _within(quantities.DEVIATION)]
DeviationDeg = Annotated[Number, _within(quantities.DEVIATION_DEG)]
AngleDeg = Annotated[Number, _within(quantities.ANGLE_DEG)]
JointPosition = Annotated[Number, _within(quantities.JOINT_POSITION)]
FieldOfViewDeg = Annotated[Number, _within(quantities.FIELD_OF_VIEW_DEG)]

MAX_ENTRIES = int(quantities.ENTRIES.high)
Entries = Field(max_length=MAX_ENTRIES)
"""Limits the length of a list or mapping of a document."""


class Document(BaseModel):
    """A mapping in a file: unknown keys are rejected, and the value is frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


QUATERNION = "quaternion_xyzw"
"""Key of an orientation in the order of ROS."""


class Placed(Document):
    """An entry with a pose in a frame that the entry or its context names."""

    xyz: tuple[Position, Position, Position] = (0.0, 0.0, 0.0)
    """Position of its origin in that frame [m]."""
    rpy_deg: tuple[AngleDeg, AngleDeg, AngleDeg] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw about that frame's fixed axes [deg]; files may give `quaternion_xyzw`."""

    @model_validator(mode="before")
    @classmethod
    def _angles_of_quaternion(cls, content: Any) -> Any:
        """Replace `quaternion_xyzw` by `rpy_deg`."""
        if not isinstance(content, Mapping) or QUATERNION not in content:
            return content
        if "rpy_deg" in content:
            raise ValueError(f"give rpy_deg or {QUATERNION}, not both")
        numbers = content[QUATERNION]
        given = isinstance(numbers, list | tuple) and len(numbers) == 4
        if not given or not all(type(n) in (int, float) and math.isfinite(n) for n in numbers):
            raise ValueError(f"{QUATERNION} must be four numbers: x, y, z, w")
        length = math.hypot(*numbers)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise ValueError(f"{QUATERNION} (x, y, z, w) has length {length:.6g}, but must have 1")
        others = {key: value for key, value in content.items() if key != QUATERNION}
        return {**others, "rpy_deg": _angles(*(n / length for n in numbers))}

    @property
    def rpy(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw about that frame's fixed axes [rad]."""
        roll, pitch, yaw = (math.radians(angle) for angle in self.rpy_deg)
        return roll, pitch, yaw


def _angles(x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """Return roll, pitch, yaw about fixed axes [deg] of a unit quaternion."""
    level = math.hypot(1 - 2 * (y * y + z * z), 2 * (x * y + w * z))
    pitch = math.atan2(2 * (w * y - z * x), level)
    if level > 1e-9:
        roll = math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
        yaw = math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    else:
        # Straight up or down, roll and yaw turn about one axis.
        roll, yaw = 0.0, math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z))
    return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)


DocumentT = TypeVar("DocumentT", bound=Document)


def read_document(
    path: Path, model: type[DocumentT], where: str, error: type[DataFileError]
) -> DocumentT:
    """Return the content of a YAML file as a checked value.

    Args:
        path: The file.
        model: Model of its content.
        where: Name of the file in messages, e.g. "task file 'shaving.yaml'".
        error: Class of the error to raise.

    Raises:
        DataFileError: As `error`, if the file cannot be read, or a value is missing or invalid.
        UnknownNameError: If a key is unknown.
    """
    content = read_mapping(path, where, error, known=model.model_fields)
    return checked(content, model, where, error)


def read_mapping(
    path: Path, where: str, error: type[DataFileError], *, known: Iterable[str]
) -> dict[str, Any]:
    """Return the keys and values of a YAML file.

    Args:
        path: The file.
        where: Name of the file in messages, e.g. "task file 'shaving.yaml'".
        error: Class of the error to raise.
        known: Keys to list in the message when the file is not a mapping.

    Raises:
        DataFileError: As `error`, if the file cannot be read, is not YAML, contains a key twice, or
            is not a mapping.
    """
    return mapping_of(read_text(path, where, error, limit=MAX_BYTES), where, error, known=known)


def mapping_of(
    text: str, where: str, error: type[DataFileError], *, known: Iterable[str]
) -> dict[str, Any]:
    """Return the keys and values of a text in YAML; as `read_mapping`."""
    try:
        content = yaml.load(text, _Loader)
    except yaml.YAMLError as reason:
        raise error(f"{where} is not valid YAML: {_yaml_fault(reason)}.") from reason
    if not isinstance(content, dict):
        raise error(f"{where} must contain keys and values: {', '.join(known)}.")
    return content


def checked(
    content: Mapping[str, Any],
    model: type[DocumentT],
    where: str,
    error: type[DataFileError],
    *,
    also_known: Iterable[str] = (),
) -> DocumentT:
    """Return the content of a file as a checked value.

    Args:
        content: Keys and values of the file.
        model: Model of its content.
        where: Name of the file in messages.
        error: Class of the error to raise.
        also_known: Keys of the file that the caller has already removed from `content`.

    Raises:
        DataFileError: As `error`, if a value is missing or invalid.
        UnknownNameError: If a key is unknown.
    """
    try:
        return model.model_validate(content)
    except ValidationError as reason:
        raise _first_fault(reason, model, where, error, tuple(also_known)) from None
    except UnknownNameError as reason:
        # A validator of the model raises it, with the field but without the file.
        located = f"{where}, {reason.where}" if reason.where else where
        raise UnknownNameError(reason.what, reason.name, reason.known, where=located) from None


MAX_BYTES = 10 * 1024**2
"""Most bytes of a YAML file: a hundred times the largest that ships."""
MAX_LEVELS = 50
"""Most lists and mappings inside each other; the files that ship have six."""
MAX_VALUES = 1_000_000
"""Most values of a YAML file after its aliases are expanded."""

_KEY_TAGS = ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge")

# Messages have one line and quote the value, so a long list is abbreviated.
_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 60


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, except that duplicate keys are rejected and 1e-3 is a number.

    Impossible values (a month 13, an integer of 5000 digits) are errors with a line number, and so
    are aliases that contain each other: they expand a hundred bytes to a billion values.
    """

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._level = 0

    def get_single_node(self) -> yaml.Node | None:
        """Return the document; refuse one whose aliases expand to too many values."""
        node = super().get_single_node()
        if node is not None:
            _count(node, {})
        return node

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Return the next node; refuse too many levels: each takes some of the stack."""
        self._level += 1
        try:
            if self._level > MAX_LEVELS:
                raise yaml.composer.ComposerError(
                    problem=f"more than {MAX_LEVELS} levels of lists or mappings",
                    problem_mark=self.get_mark(),
                )
            return super().compose_node(parent, index)
        finally:
            self._level -= 1

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Return the value of a node; refuse what its tag does not allow."""
        try:
            return super().construct_object(node, deep=deep)
        except yaml.YAMLError:
            raise
        except Exception as reason:
            # PyYAML's constructors raise errors of many classes for a value that its tag forbids.
            shown = f" {_SHORT.repr(node.value)}" if isinstance(node, yaml.ScalarNode) else ""
            why = f": {reason}" if type(reason) is ValueError else ""
            raise yaml.constructor.ConstructorError(
                problem=f"impossible value{shown}{why}", problem_mark=node.start_mark
            ) from None

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Return a mapping; raise for a duplicate key, of which PyYAML would drop the first."""
        seen = set()
        for key_node, _ in node.value:
            if key_node.tag not in _KEY_TAGS:
                raise yaml.constructor.ConstructorError(
                    problem="a key must be text", problem_mark=key_node.start_mark
                )
            if key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    problem=f"key '{key_node.value}' appears twice",
                    problem_mark=key_node.start_mark,
                )
            seen.add(key_node.value)
        return super().construct_mapping(node, deep)


# PyYAML follows YAML 1.1, where 1e-3 is text; in YAML 1.2 it is a number.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)


def _count(node: yaml.Node, counted: dict[int, int]) -> int:
    """Return the number of values of a node, its aliases expanded; refuse more than MAX_VALUES."""
    if id(node) in counted:
        return counted[id(node)]
    # Until it is counted, a node that contains itself is one value too many.
    counted[id(node)] = MAX_VALUES + 1
    inside: list[yaml.Node] = []
    if isinstance(node, yaml.MappingNode):
        inside = [part for pair in node.value for part in pair]
    elif isinstance(node, yaml.SequenceNode):
        inside = node.value
    total = 1
    for part in inside:
        total += _count(part, counted)
        if total > MAX_VALUES:
            raise yaml.constructor.ConstructorError(
                problem=f"more than {MAX_VALUES:,} values; aliases must not contain each other",
                problem_mark=node.start_mark,
            )
    counted[id(node)] = total
    return total


def _yaml_fault(error: yaml.YAMLError) -> str:
    """Return the position and the problem of a YAML error, on one line."""
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
    return " ".join(str(error).split())


def _first_fault(
    reason: ValidationError,
    model: type[BaseModel],
    where: str,
    error: type[DataFileError],
    also_known: tuple[str, ...],
) -> DataFileError | UnknownNameError:
    """Return an error of one line that names the first fault."""
    details = reason.errors(include_url=False)
    # A misspelt key also makes the right one missing; the message names the misspelling.
    details.sort(key=lambda detail: detail["type"] != "extra_forbidden")
    first, location = details[0], list(details[0]["loc"])
    if first["type"] == "extra_forbidden":
        *holder, key = location
        known = _keys_at(model, holder) + (() if holder else also_known)
        return UnknownNameError("key", str(key), known, where=_described(where, holder))
    text = f"{_described(where, location)}{_fault(first)}"
    others = len(details) - 1
    return error(text + (f" ({others} more after this one.)" if others else ""))


# Pydantic's messages name Python types; the author of a file writes YAML.
_YAML_TERMS = (
    (re.compile(r"^(?:Input|List|Tuple|String|Value|Dictionary) should "), "must "),
    (re.compile(r"valid dictionary(?: or instance of \w+)?"), "mapping of keys to values"),
    (re.compile(r"valid tuple"), "valid list"),
    (re.compile(r"valid boolean, unable to interpret input"), "valid boolean (true or false)"),
    (re.compile(r" after validation, not \d+$"), ""),
)


def _fault(detail: ErrorDetails) -> str:
    """Return the predicate of a message: " is missing." or " is 4, but must be a valid list."."""
    if detail["type"] == "missing":
        return " is missing."
    rule = detail["msg"]
    if detail["type"] == "out_of_range":
        return f" is {rule}."
    if rule.startswith("Value error, "):
        return f": {rule.removeprefix('Value error, ')}."
    for pattern, term in _YAML_TERMS:
        rule = pattern.sub(term, rule)
    return f" is {_SHORT.repr(detail['input'])}, but {rule}."


def _described(where: str, location: list[int | str]) -> str:
    """Return a location in a file, e.g. "task file 'a.yaml', field 'goals[2].position'"."""
    if not location:
        return where
    parts = (f"[{p}]" if isinstance(p, int) else f".{one_line(p)}" for p in location)
    return f"{where}, field '{''.join(parts).lstrip('.')}'"


def _keys_at(model: type[BaseModel], location: list[int | str]) -> tuple[str, ...]:
    """Return the keys of the document at a location inside a document."""
    owner = model
    for part in location:
        if isinstance(part, str) and part in owner.model_fields:
            owner = _document_inside(owner.model_fields[part].annotation) or owner
    return tuple(owner.model_fields)


def _document_inside(annotation: object) -> type[BaseModel] | None:
    """Return the document inside a type such as list[Document] or dict[str, Document]."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        found = _document_inside(argument)
        if found is not None:
            return found
    return None
