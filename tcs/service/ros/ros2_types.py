"""Types of ROS 2 out of the files of `ros/`: classes, serialisation, and their hashes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tcs.files.paths import data_folder

PACKAGE = "tcs_msgs"
_ACTION_PARTS = {
    "SendGoal_Request": "unique_identifier_msgs/UUID goal_id\n{action}_Goal goal",
    "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp",
    "GetResult_Request": "unique_identifier_msgs/UUID goal_id",
    "GetResult_Response": "int8 status\n{action}_Result result",
    "FeedbackMessage": "unique_identifier_msgs/UUID goal_id\n{action}_Feedback feedback",
}
"""Messages that ROS 2 generates from an action (design.ros2.org, "Actions")."""
_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"
_CANCEL = (
    "action_msgs/GoalInfo goal_info",
    "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
)


class Ros2Types:
    """The types of tcs and those of ROS 2 that they are made of."""

    def __init__(self) -> None:
        """Read the definitions of `ros/tcs_msgs`."""
        self._store = get_typestore(Stores.ROS2_JAZZY)
        # The `char` of a message file is an unsigned byte of the type descriptions of ROS 2.
        constants, fields = self._store.fielddefs[_EVENT_INFO]
        byte: Any = (Nodetype.ARRAY, ((Nodetype.BASE, ("uint8", 0)), 16))
        self._store.fielddefs[_EVENT_INFO] = (
            constants,
            [(name, byte if name == "client_gid" else kind) for name, kind in fields],
        )
        folder = data_folder() / "ros" / PACKAGE
        for path in sorted(folder.glob("msg/*.msg"), key=_dependent_last):
            self._add(f"{PACKAGE}/msg/{path.stem}", path.read_text())
        for path in sorted(folder.glob("srv/*.srv")):
            self._add_service(f"{PACKAGE}/srv/{path.stem}", *_sections(path))
        for path in sorted(folder.glob("action/*.action")):
            self._add_action(f"{PACKAGE}/action/{path.stem}", *_sections(path))
        self._add_service("action_msgs/srv/CancelGoal", *_CANCEL)

    def make(self, name: str, /, **fields: Any) -> Any:
        """Return a message; fields that are not given are zero or empty.

        Args:
            name: Name of the type, e.g. "tcs_msgs/srv/Call_Request".
            **fields: Values of its fields.
        """
        return self._store.types[name](**{**self._empty(name), **fields})

    def encode(self, name: str, message: Any) -> bytes:
        """Return a message in the encoding of ROS 2."""
        return bytes(self._store.serialize_cdr(message, name))

    def decode(self, name: str, data: bytes) -> Any:
        """Return the message that some bytes encode.

        Raises:
            Exception: If they do not: the library raises what it meets.
        """
        return self._store.deserialize_cdr(data, name)

    def hash_of(self, name: str) -> str:
        """Return the hash of a type, service or action part (REP 2011)."""
        return str(self._store.hash_rihs01(name))

    def _empty(self, name: str) -> dict[str, Any]:
        """Return the fields of an empty message."""
        return {field: self._default(*kind) for field, kind in self._store.fielddefs[name][1]}

    def _default(self, node: Any, content: Any) -> Any:
        if node == Nodetype.NAME:
            return self.make(content)
        if node == Nodetype.BASE:
            return {"string": "", "bool": False}.get(
                content[0], 0.0 if "float" in content[0] else 0
            )
        (inner, base), count = content
        if inner == Nodetype.BASE and base[0] not in ("string", "bool"):
            size = count if node == Nodetype.ARRAY else 0
            return np.zeros(size, dtype=base[0])
        return [self._default(inner, base) for _ in range(count if node == Nodetype.ARRAY else 0)]

    def _add(self, name: str, text: str) -> None:
        """Register a message; types without a package are of its own package and part."""
        package, part, _ = name.split("/")
        # The parser knows names of messages only.
        ((_, (constants, fields)),) = get_types_from_msg(text, f"{package}/msg/Parsed").items()
        local = {
            f"{package}/msg/{own.rpartition('/')[2]}": own
            for own in self._store.fielddefs
            if own.startswith(f"{package}/{part}/")
        }
        renamed = [(field, _renamed(kind, local)) for field, kind in fields]
        self._store.register({name: (constants, renamed)})

    def _add_service(self, name: str, request: str, response: str) -> None:
        """Register a service: its messages, and the type that its hash is of."""
        self._add(f"{name}_Request", request)
        self._add(f"{name}_Response", response)
        self._add_service_type(name)

    def _add_service_type(self, name: str) -> None:
        """Register the type of a service whose messages are registered."""

        def at_most_one(message: str) -> Any:
            return Nodetype.SEQUENCE, ((Nodetype.NAME, message), 1)

        event: Any = [
            ("info", (Nodetype.NAME, _EVENT_INFO)),
            ("request", at_most_one(f"{name}_Request")),
            ("response", at_most_one(f"{name}_Response")),
        ]
        self._store.register({f"{name}_Event": ([], event)})
        parts: Any = [
            (f"{part.lower()}_message", (Nodetype.NAME, f"{name}_{part}"))
            for part in ("Request", "Response", "Event")
        ]
        self._store.register({name: ([], parts)})

    def _add_action(self, name: str, goal: str, result: str, feedback: str) -> None:
        """Register the messages and services of an action."""
        for part, text in (("Goal", goal), ("Result", result), ("Feedback", feedback)):
            self._add(f"{name}_{part}", text)
        action = name.rpartition("/")[2]
        for part, text in _ACTION_PARTS.items():
            self._add(f"{name}_{part}", text.format(action=action))
        for part in ("SendGoal", "GetResult"):
            self._add_service_type(f"{name}_{part}")


def _renamed(kind: Any, names: dict[str, str]) -> Any:
    """Return the type of a field with other names of messages."""
    node, content = kind
    if node == Nodetype.NAME:
        return node, names.get(content, content)
    if node == Nodetype.BASE:
        return kind
    return node, (_renamed(content[0], names), content[1])


def _sections(path: Path) -> list[str]:
    """Return the parts of a definition between the lines `---`."""
    return path.read_text().split("\n---\n")


def _dependent_last(path: Path) -> int:
    """Return the length of a definition: a message is longer than those it is made of."""
    return path.stat().st_size
