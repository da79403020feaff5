import numpy as np
import pytest

from tcs.capability.bags import read_bags
from tcs.errors import DataFileError
from tests.capability.test_recording import LISTING, NAMES

pytest.importorskip("rosbags")
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore


def joint_state(types, names, positions):
    """Return a sensor_msgs/JointState."""
    header = {"stamp": types.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0), "frame_id": ""}
    if "seq" in types.types["std_msgs/msg/Header"].__dataclass_fields__:
        header["seq"] = 0
    empty = np.zeros(0)
    return types.types["sensor_msgs/msg/JointState"](
        header=types.types["std_msgs/msg/Header"](**header),
        name=list(names),
        position=np.asarray(positions, dtype=np.float64),
        velocity=empty,
        effort=empty,
    )


def write_bag(path, messages, generation=1, topic="/joint_states"):
    """Write joint states, each (names, positions), as a bag of ROS 1 or 2."""
    map_type = "sensor_msgs/msg/JointState"
    types = get_typestore(Stores.ROS1_NOETIC if generation == 1 else Stores.ROS2_HUMBLE)
    writer = Writer1(path) if generation == 1 else Writer2(path, version=9)
    with writer:
        connection = writer.add_connection(topic, map_type, typestore=types)
        serialize = types.serialize_ros1 if generation == 1 else types.serialize_cdr
        for i, message in enumerate(messages):
            data = serialize(joint_state(types, *message), map_type)
            writer.write(connection, i * 20_000_000, data)
    return path


@pytest.mark.parametrize("generation", [1, 2])
def test_joint_states_of_both_generations(generation, tiago, tmp_path):
    path = tmp_path / ("arm.bag" if generation == 1 else "arm")
    order = list(reversed(range(len(NAMES))))
    shuffled = ([NAMES[i] for i in order], [LISTING[i] for i in order])
    write_bag(path, [(NAMES, LISTING), shuffled, (["head_1_joint"], [0.1])], generation)
    found = read_bags([path], tiago)
    np.testing.assert_array_equal(found.joints, [LISTING[:7]] * 2)
    np.testing.assert_array_equal(found.torso_height, [LISTING[8]] * 2)


def test_several_bags_are_concatenated(tiago, tmp_path):
    other = [0.5, *LISTING[1:]]
    first = write_bag(tmp_path / "a.bag", [(NAMES, LISTING)])
    second = write_bag(tmp_path / "b.bag", [(NAMES, other)])
    found = read_bags([first, second], tiago)
    np.testing.assert_array_equal(found.joints[:, 0], [LISTING[0], 0.5])


def test_a_bag_without_joint_states(tiago, tmp_path):
    path = tmp_path / "words.bag"
    types = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(path) as writer:
        connection = writer.add_connection("/words", "std_msgs/msg/String", typestore=types)
        word = types.types["std_msgs/msg/String"](data="hello")
        writer.write(connection, 0, types.serialize_ros1(word, "std_msgs/msg/String"))
    with pytest.raises(DataFileError, match=r"has no joint states. It has: /words \(std_msgs"):
        read_bags([path], tiago)


def test_a_topic_without_joint_states(tiago, tmp_path):
    path = write_bag(tmp_path / "a.bag", [(NAMES, LISTING)])
    with pytest.raises(DataFileError, match="no joint states on topic '/arm'"):
        read_bags([path], tiago, topic="/arm")


def test_joint_names_that_do_not_match(tiago, tmp_path):
    path = write_bag(tmp_path / "a.bag", [(NAMES[1:], LISTING[1:])])
    with pytest.raises(DataFileError, match="do not match robot 'tiago': arm_1_joint missing"):
        read_bags([path], tiago)


def test_names_that_are_never_in_one_message(tiago, tmp_path):
    halves = [(NAMES[:4], LISTING[:4]), (NAMES[4:], LISTING[4:])]
    path = write_bag(tmp_path / "a.bag", halves)
    with pytest.raises(DataFileError, match="never all in one message"):
        read_bags([path], tiago)


def test_nan_in_a_bag(tiago, tmp_path):
    path = write_bag(tmp_path / "a.bag", [(NAMES, LISTING), (NAMES, [np.nan, *LISTING[1:]])])
    with pytest.raises(DataFileError, match="sample 1, joint 'arm_1_joint' is nan"):
        read_bags([path], tiago)
    assert len(read_bags([path], tiago, drop_bad=True)) == 1


def test_more_names_than_positions(tiago, tmp_path):
    path = write_bag(tmp_path / "a.bag", [(NAMES, LISTING[:-1])])
    with pytest.raises(DataFileError, match="9 names and 8 positions"):
        read_bags([path], tiago)


def test_files_that_are_not_bags(tiago, tmp_path):
    with pytest.raises(DataFileError, match="does not exist"):
        read_bags([tmp_path / "none.bag"], tiago)
    path = tmp_path / "text.bag"
    path.write_text("not a bag")
    with pytest.raises(DataFileError, match="cannot be read"):
        read_bags([path], tiago)
