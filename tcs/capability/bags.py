"""Joint states out of ROS bags, both generations; needs the extra `bags`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tcs.capability.recording import Recording, recording_of
from tcs.errors import DataFileError
from tcs.model.robots import RobotFile

JOINT_STATE = "sensor_msgs/msg/JointState"


def read_bags(
    paths: list[Path], robot: RobotFile, *, topic: str | None = None, drop_bad: bool = False
) -> Recording:
    """Return the recording in ROS 1 bag files or ROS 2 bag folders, in the order given.

    Args:
        paths: `.bag` files, or folders that hold a `metadata.yaml`.
        robot: The robot.
        topic: Topic of the joint states; None takes every topic of that type.
        drop_bad: As in `recording_of`.

    Raises:
        DataFileError: If the package `rosbags` is not installed, a bag cannot be read, or holds no
            joint states of the arm.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise DataFileError(
            "reading ROS bags needs the package rosbags: pip install 'tcs[bags]'."
        ) from None
    wanted = list(robot.arm_joints)
    torso = robot.torso_joint
    samples, lifts, seen = [], [], set[str]()
    where = f"bag '{paths[0]}'" + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")
    for path in paths:
        if not path.exists():
            raise DataFileError(f"bag '{path}' is not there.")
        try:
            # ROS 2 bags without message definitions are read by those of a release with long
            # support; joint states have not changed since.
            with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                states = [c for c in reader.connections if c.msgtype == JOINT_STATE]
                connections = [c for c in states if topic is None or c.topic == topic]
                if not connections:
                    there = ", ".join(
                        sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})
                    )
                    asked = f" on topic '{topic}'" if topic else ""
                    raise DataFileError(
                        f"bag '{path}' holds no joint states{asked}. It holds: {there or 'none'}."
                    )
                for connection, _, raw in reader.messages(connections):
                    message: Any = reader.deserialize(raw, connection.msgtype)
                    names = list(message.name)
                    seen.update(names)
                    # Grippers and heads may publish states of their own on the same topic.
                    if not set(wanted) <= set(names):
                        continue
                    if len(message.position) != len(names):
                        raise DataFileError(
                            f"bag '{path}', topic '{connection.topic}': a message has "
                            f"{len(names)} names and {len(message.position)} positions."
                        )
                    place = dict(zip(names, message.position, strict=True))
                    samples.append([float(place[name]) for name in wanted])
                    lifts.append(float(place.get(torso, np.nan)) if torso else np.nan)
        except AnyReaderError as error:
            said = " ".join(str(error).split())
            raise DataFileError(f"bag '{path}' cannot be read: {said}.") from None
    if not samples:
        missing = [name for name in wanted if name not in seen]
        said = f"{', '.join(missing)} missing" if missing else "never all in one message"
        raise DataFileError(
            f"{where}: joint names do not match robot '{robot.name}': {said}. "
            f"It holds: {', '.join(sorted(seen)) or 'none'}."
        )
    columns, table = wanted, np.array(samples)
    if torso is not None and np.isfinite(lifts).all():
        columns, table = [*wanted, torso], np.column_stack([table, lifts])
    return recording_of(columns, table, robot, where=where, drop_bad=drop_bad)
