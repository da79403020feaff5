"""A node of ROS 1 with a master of Debian: where to stand, with robot and person from tf."""

from __future__ import annotations

import json
import math
import time
from types import SimpleNamespace

import pytest

from tcs.errors import ServiceError
from tcs.placement.store import save_scores
from tcs.service import Engine, SelectRequest
from tcs.service.ros import FrameNames, PlacedStop, Placer, Trajectory
from tcs.service.ros.ros1 import Ros1Node
from tcs.service.ros.ros1_types import ros1_modules, ros1_types
from tests.placement.store.example import score_file

# rospy leaves the sockets of its connections to the collector.
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
# The environment at (3, -1) of the map, turned by 0.8 rad; the robot at (1.4, -1.2) in it.
FRAMES = {
    "environment": ("map", (3.0, -1.0, 0.0), 0.8),
    "base_link": ("environment", (1.4, -1.2, 0.0), 2.5),
}


@pytest.fixture(scope="module")
def ros(ros1_master, tmp_path_factory):
    """A node that holds a score file, the types of its services, and the packages of ROS."""
    path = tmp_path_factory.mktemp("ros1") / "small.tcs"
    save_scores(path, score_file())
    names = FrameNames(base="base_link")
    with Engine() as engine, Ros1Node(engine, names, max_age=5.0) as node, ros1_types() as types:
        engine.open_file(path)
        modules = ros1_modules()
        place = modules.rospy.ServiceProxy("/tcs/place_robot", types.srv.PlaceRobot)
        yield SimpleNamespace(
            engine=engine, node=node, types=types, modules=modules, place=place
        )  # fmt: skip


@pytest.fixture
def frames(ros):
    """The frames, published on /tf_static."""
    from geometry_msgs.msg import TransformStamped

    message = ros.modules.tf2_msgs.TFMessage()
    for child, (parent, position, yaw) in FRAMES.items():
        one = TransformStamped()
        one.header.frame_id, one.child_frame_id = parent, child
        p, q = one.transform.translation, one.transform.rotation
        p.x, p.y, p.z = position
        q.z, q.w = math.sin(yaw / 2), math.cos(yaw / 2)
        message.transforms.append(one)
    topic = ros.modules.rospy.Publisher(
        "/tf_static", ros.modules.tf2_msgs.TFMessage, latch=True, queue_size=1
    )
    topic.publish(message)
    yield
    topic.unregister()


def request(ros, **fields):
    made = ros.types.srv.PlaceRobotRequest(**fields)
    made.environment_settings = [ros.types.msg.Setting("bed_height", 0.0)]
    return made


def test_where_to_stand_from_tf(ros, frames):
    end = time.monotonic() + 10.0
    answer = ros.place(request(ros, task="shaving"))
    while not answer.success and time.monotonic() < end:
        # The topic takes a moment to arrive.
        assert "tf: unknown frame" in answer.detail
        time.sleep(0.1)
        answer = ros.place(request(ros, task="shaving"))
    assert answer.success, answer.detail
    expected = ros.engine.select(
        SelectRequest(file=answer.file, here=(1.4, -1.2, math.degrees(2.5)), at={"bed_height": 0.0})
    )
    assert json.loads(answer.answer)["members"] == expected["members"]
    assert answer.reachability == expected["reachability"]
    assert answer.net_utility == pytest.approx(expected["net_utility"])
    for one, member in zip(answer.configurations, expected["members"], strict=True):
        pose = one.base_pose
        assert pose.header.frame_id == "environment"
        assert pose.header.stamp.to_sec() > 0.0
        assert pose.pose.position.x == member["base_x"]
        assert pose.pose.position.y == member["base_y"]
        yaw = 2.0 * math.atan2(pose.pose.orientation.z, pose.pose.orientation.w)
        assert math.cos(yaw - math.radians(member["base_yaw_deg"])) == pytest.approx(1.0)
        assert one.torso_height == member["torso"]
        assert [(s.name, s.value) for s in one.environment] == [
            ("bed_height", member["bed_height"])
        ]
        assert not one.trajectories


def test_errors_have_their_line(ros):
    answer = ros.place(request(ros, task="shavign"))
    assert not answer.success
    assert answer.error == "NotFoundError"
    assert answer.detail.startswith("no score file of task 'shavign' is held.")


def test_trajectories_are_sent(ros, monkeypatch):
    """A plan arrives as trajectories of the joints, with times from the start of each."""
    motion = Trajectory(("a", "b"), [0.0, 0.5], [[0.0, 1.0], [0.25, 1.5]], [[0.0, 0.0], [0.5, 0.1]])
    stop = PlacedStop(1.0, 2.0, 0.0, 0.3, {}, goals=(4, 2), trajectories=(motion, motion))
    choice = {"members": [], "reachability": 1, "manipulability": 0.5, "net_utility": 1.4}
    placement = SimpleNamespace(file="f", stops=(stop,), choice=choice)
    monkeypatch.setattr(Placer, "place", lambda _self, _request: placement)
    answer = ros.place(request(ros, plan=True))
    (one,) = answer.configurations
    assert list(one.goals) == [4, 2]
    assert len(one.trajectories) == 2
    assert one.trajectories[0].joint_names == ["a", "b"]
    first, second = one.trajectories[0].points
    assert (list(first.positions), first.time_from_start.to_sec()) == ([0.0, 1.0], 0.0)
    assert (list(second.positions), second.time_from_start.to_sec()) == ([0.25, 1.5], 0.5)
    assert list(second.velocities) == [0.5, 0.1]


def test_without_a_master(ros, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.setattr(ros.modules.rospy.core, "is_initialized", lambda: False)
    with pytest.raises(ServiceError, match=r"no ROS master answers at http://127.0.0.1:1"):
        Ros1Node(ros.engine, FrameNames(), max_age=5.0)
