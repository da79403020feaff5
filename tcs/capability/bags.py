"""Joint states from ROS 1 and ROS 2 bags; requires the extra `bags`."""

from __future__ import annotations

import os
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
        paths: `.bag` files, or folders that contain a `metadata.yaml`.
        robot: The robot.
        topic: Topic of the joint states; None takes every topic of that type.
        drop_bad: As in `recording_of`.

    Raises:
        DataFileError: If the package `rosbags` is not installed, a bag cannot be read, or it has no
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
    samples, torso_heights, found = [], [], set[str]()
    where = f"bag '{paths[0]}'" + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")
    for path in paths:
        if not os.path.isdir(path) and not os.path.isfile(path):
            raise DataFileError(f"bag '{path}' does not exist, or is neither a file nor a folder.")
        try:
            # ROS 2 bags without message definitions use those of a long-term release; joint states
            # have not changed since.
            with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
                states = [c for c in reader.connections if c.msgtype == JOINT_STATE]
                connections = [c for c in states if topic is None or c.topic == topic]
                if not connections:
                    topics = ", ".join(
                        sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})
                    )
                    which = f" on topic '{topic}'" if topic else ""
                    raise DataFileError(
                        f"bag '{path}' has no joint states{which}. It has: {topics or 'none'}."
                    )
                for connection, _, raw in reader.messages(connections):
                    message: Any = reader.deserialize(raw, connection.msgtype)
                    names = list(message.name)
                    found.update(names)
                    # Grippers and heads may publish on the same topic.
                    if not set(wanted) <= set(names):
                        continue
                    if len(message.position) != len(names):
                        raise DataFileError(
                            f"bag '{path}', topic '{connection.topic}': a message has "
                            f"{len(names)} names and {len(message.position)} positions."
                        )
                    position = dict(zip(names, message.position, strict=True))
                    samples.append([float(position[name]) for name in wanted])
                    torso_heights.append(float(position.get(torso, np.nan)) if torso else np.nan)
        except AnyReaderError as error:
            cause = " ".join(str(error).split())
            raise DataFileError(f"bag '{path}' cannot be read: {cause}.") from None
        except DataFileError:
            raise
        except Exception as error:
            # Its readers raise errors of many classes for a damaged bag.
            raise DataFileError(
                f"bag '{path}' is damaged ({type(error).__name__} while reading)."
            ) from None
    if not samples:
        missing = [name for name in wanted if name not in found]
        cause = f"{', '.join(missing)} missing" if missing else "never all in one message"
        raise DataFileError(
            f"{where}: joint names do not match robot '{robot.name}': {cause}. "
            f"It has: {', '.join(sorted(found)) or 'none'}."
        )
    columns, table = wanted, np.array(samples)
    if torso is not None and np.isfinite(torso_heights).all():
        columns, table = [*wanted, torso], np.column_stack([table, torso_heights])
    return recording_of(columns, table, robot, where=where, drop_bad=drop_bad)
