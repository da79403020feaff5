"""A node of ROS 2 and clients without ROS: keys and hashes, tf, and jobs as an action."""

from __future__ import annotations

import json
import math
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
import zenoh

from tcs.errors import ServiceError
from tcs.files.paths import data_folder
from tcs.placement.store import save_scores
from tcs.service import Engine, SelectRequest
from tcs.service.ros import FrameNames
from tcs.service.ros.ros2 import domain_of_environment
from tcs.service.ros.ros2_types import Ros2Types
from tests.placement.store.example import score_file
from tests.service.ros2_peer import SECONDS, config, free_port, ros2_peers
from tests.service.ros2_peer import Ros2Node as Node

ACTION = "tcs_msgs/action/RunJob"
INNER = "/tcs/run_job/_action"
AT = {"bed_height": 0.0}


@pytest.fixture(scope="module")
def ros(tmp_path_factory):
    path = tmp_path_factory.mktemp("ros2") / "small.tcs"
    save_scores(path, score_file())
    with Engine() as engine, ros2_peers(engine, FrameNames(base="base_link")) as (_, peer):
        file = engine.open_file(path).file
        yield SimpleNamespace(engine=engine, peer=peer, types=peer.types, file=file)


def until(condition):
    end = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_hashes_are_those_of_ros():
    """Of a service of ROS 2 itself, as `ros2 service` and the SDK state it, and of messages."""
    types = Ros2Types()
    types._add_service("example_interfaces/srv/AddTwoInts", "int64 a\nint64 b", "int64 sum")
    assert types.hash_of("example_interfaces/srv/AddTwoInts") == (
        "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
    )
    assert types.hash_of("std_msgs/msg/String") == (
        "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    )


def test_hash_of_the_calls_is_that_of_the_sdk():
    utils = pytest.importorskip("zenoh_ros2_sdk.utils")
    request, response = (data_folder() / "ros/tcs_msgs/srv/Call.srv").read_text().split("\n---\n")
    expected = utils.compute_service_type_hash("tcs_msgs/srv/Call", request, response)
    assert Ros2Types().hash_of("tcs_msgs/srv/Call") == expected


def test_a_client_of_the_sdk(tmp_path):
    """The SDK of others, which was written for rmw_zenoh, finds the service and calls it."""
    sdk = pytest.importorskip("zenoh_ros2_sdk")
    definitions = (data_folder() / "ros/tcs_msgs/srv/Call.srv").read_text().split("\n---\n")
    port = free_port()
    with Engine() as engine, Node(engine, FrameNames(), config("listen", port), max_age=5.0):
        client = sdk.ROS2ServiceClient(
            "/tcs/list", "tcs_msgs/srv/Call", *definitions, domain_id=0,
            router_ip="127.0.0.1", router_port=port, timeout=SECONDS,
        )  # fmt: skip
        try:
            names = dict(
                sdk.get_service_names_and_types(
                    domain_id=0, router_ip="127.0.0.1", router_port=port
                )
            )
            answer = client.call(request="")
        finally:
            client.close()
            sdk.ZenohSession.get_instance().close()
    assert names["/tcs/place_robot"] == ["tcs_msgs/srv/PlaceRobot"]
    assert names["/tcs/select"] == ["tcs_msgs/srv/Call"]
    assert answer.success
    assert "shaving" in [task["name"] for task in json.loads(answer.answer)["tasks"]]


def transform(types, parent, child, position, yaw):
    x, y, z = position
    return types.make(
        "geometry_msgs/msg/TransformStamped",
        header=types.make("std_msgs/msg/Header", frame_id=parent),
        child_frame_id=child,
        transform=types.make(
            "geometry_msgs/msg/Transform",
            translation=types.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=types.make(
                "geometry_msgs/msg/Quaternion", z=math.sin(yaw / 2), w=math.cos(yaw / 2)
            ),
        ),
    )


def place(ros, **fields):
    setting = ros.types.make("tcs_msgs/msg/Setting", name="bed_height")
    return ros.peer.call(
        "/tcs/place_robot", "tcs_msgs/srv/PlaceRobot", environment_settings=[setting], **fields
    )


def test_where_to_stand_from_tf(ros):
    one = transform(ros.types, "map", "environment", (3.0, -1.0, 0.0), 0.8)
    two = transform(ros.types, "environment", "base_link", (1.4, -1.2, 0.0), 2.5)
    for name, found in (("/tf_static", one), ("/tf", two)):
        publish = ros.peer.publisher(name, "tf2_msgs/msg/TFMessage", latched=name == "/tf_static")
        publish(ros.types.make("tf2_msgs/msg/TFMessage", transforms=[found]))
        ros.peer.declared.append(publish)
    until(lambda: place(ros, task="shaving").success)
    answer = place(ros, task="shaving")
    expected = ros.engine.select(
        SelectRequest(file=ros.file, here=(1.4, -1.2, math.degrees(2.5)), at=AT)
    )
    assert json.loads(answer.answer)["members"] == expected["members"]
    assert answer.reachability == expected["reachability"]
    for found, member in zip(answer.configurations, expected["members"], strict=True):
        pose = found.base_pose
        assert pose.header.frame_id == "environment"
        assert pose.header.stamp.sec > 0
        assert pose.pose.position.x == member["base_x"]
        assert pose.pose.position.y == member["base_y"]
        yaw = 2.0 * math.atan2(pose.pose.orientation.z, pose.pose.orientation.w)
        assert math.cos(yaw - math.radians(member["base_yaw_deg"])) == pytest.approx(1.0)
        assert found.torso_height == member["torso"]
        assert [(s.name, s.value) for s in found.environment] == [
            ("bed_height", member["bed_height"])
        ]


def test_static_frames_from_before_the_node():
    """A robot publishes /tf_static once: a node that starts later gets it all the same."""
    port = free_port()
    types = Ros2Types()
    with zenoh.open(config("listen", port)) as robot:
        name = "tf2_msgs::msg::dds_::TFMessage_"
        publisher = zenoh.ext.declare_advanced_publisher(
            robot, f"0/tf_static/{name}/{types.hash_of('tf2_msgs/msg/TFMessage')}",
            cache=zenoh.ext.CacheConfig(1), publisher_detection=True,
        )  # fmt: skip
        frames = types.make(
            "tf2_msgs/msg/TFMessage",
            transforms=[transform(types, "map", "marker", (0.0, 0.0, 1.0), 0.0)],
        )
        publisher.put(types.encode("tf2_msgs/msg/TFMessage", frames))
        with (
            Engine() as engine,
            Node(engine, FrameNames(), config("connect", port), max_age=5.0) as node,
        ):
            until(lambda: "marker" in node._tree._parent)


@pytest.fixture
def counting(monkeypatch, in_process):
    """Scoring that counts until it is released."""
    released = threading.Event()

    def score(*_arguments, on_progress, **_options):
        for done in range(1000):
            on_progress(done, 1000)
            if released.wait(0.01):
                return score_file(
                    metadata={
                        **score_file().metadata,
                        "timings": dict.fromkeys(
                            ("compile_seconds", "scoring_seconds", "sets_seconds", "total_seconds"),
                            0.5,
                        ),
                    }
                )
        raise AssertionError("not released")

    monkeypatch.setattr("tcs.placement.scoring.score", score)
    yield released.set
    released.set()


class Goal:
    """A goal of the action."""

    def __init__(self, ros, number, name, request):
        self._ros = ros
        self.uuid = ros.types.make(
            "unique_identifier_msgs/msg/UUID", uuid=np.full(16, number, dtype=np.uint8)
        )
        goal = ros.types.make(f"{ACTION}_Goal", name=name, request=request)
        answer = ros.peer.call(
            f"{INNER}/send_goal", f"{ACTION}_SendGoal", goal_id=self.uuid, goal=goal
        )
        assert answer.accepted
        assert answer.stamp.sec > 0

    def result(self):
        """Return what waits for the result."""
        return self._ros.peer.send(f"{INNER}/get_result", f"{ACTION}_GetResult", goal_id=self.uuid)

    def cancel(self):
        info = self._ros.types.make("action_msgs/msg/GoalInfo", goal_id=self.uuid)
        return self._ros.peer.call(
            f"{INNER}/cancel_goal", "action_msgs/srv/CancelGoal", goal_info=info
        )


def test_goal_has_feedback_and_a_result(ros, counting):
    feedback = ros.peer.subscribe(f"{INNER}/feedback", f"{ACTION}_FeedbackMessage")
    statuses = ros.peer.subscribe(f"{INNER}/status", "action_msgs/msg/GoalStatusArray")
    time.sleep(0.3)
    goal = Goal(ros, 1, "score", json.dumps({"task": "shaving"}))
    wait = goal.result()
    until(lambda: len([f for f in feedback if f.feedback.done]) >= 2)
    one, two, *_ = [f for f in feedback if f.feedback.done]
    assert bytes(one.goal_id.uuid) == b"\x01" * 16
    assert one.feedback.state == "running"
    assert one.feedback.done < two.feedback.done <= two.feedback.total == 1000
    assert statuses[-1].status_list[-1].status == 2
    counting()
    ended = wait()
    assert (ended.status, ended.result.state, ended.result.problem) == (4, "done", "")
    result = json.loads(ended.result.result)
    assert result["file"] in [entry.file for entry in ros.engine.files()]
    until(lambda: statuses[-1].status_list[-1].status == 4)
    # A result may be requested again, and later.
    assert goal.result()().result.result == ended.result.result
    assert goal.cancel().return_code == 3


def test_goal_is_cancelled(ros, counting):
    goal = Goal(ros, 2, "score", json.dumps({"task": "shaving"}))
    wait = goal.result()
    answer = goal.cancel()
    assert answer.return_code == 0
    assert [bytes(info.goal_id.uuid) for info in answer.goals_canceling] == [b"\x02" * 16]
    ended = wait()
    assert (ended.status, ended.result.state) == (5, "cancelled")


def test_all_goals_are_cancelled(ros, counting):
    goals = [Goal(ros, number, "score", '{"task": "shaving"}') for number in (3, 4)]
    everything = ros.types.make("action_msgs/msg/GoalInfo")
    answer = ros.peer.call(
        f"{INNER}/cancel_goal", "action_msgs/srv/CancelGoal", goal_info=everything
    )
    assert len(answer.goals_canceling) == 2
    assert [goal.result()().status for goal in goals] == [5, 5]


@pytest.mark.parametrize(
    ("number", "name", "request_text", "line"),
    [
        (10, "select", "{}", "'select' is not the name of a job. Known: evaluate, "),
        (11, "score", "[", "request is not valid JSON"),
        (12, "score", '{"tsak": 1}', "unknown key 'tsak'"),
        (13, "plan", json.dumps({"file": "0" * 64}), "no score file 000000000000"),
    ],
)
def test_goals_that_are_refused_are_aborted_with_a_line(ros, number, name, request_text, line):
    goal = Goal(ros, number, name, request_text)
    ended = goal.result()()
    assert (ended.status, ended.result.state) == (6, "failed")
    assert line in ended.result.problem
    assert "\n" not in ended.result.problem


def test_goals_that_are_unknown(ros):
    uuid = ros.types.make("unique_identifier_msgs/msg/UUID", uuid=np.full(16, 255, dtype=np.uint8))
    info = ros.types.make("action_msgs/msg/GoalInfo", goal_id=uuid)
    answer = ros.peer.call(f"{INNER}/cancel_goal", "action_msgs/srv/CancelGoal", goal_info=info)
    assert (answer.return_code, list(answer.goals_canceling)) == (2, [])
    answer = ros.peer.call(f"{INNER}/get_result", f"{ACTION}_GetResult", goal_id=uuid)
    assert (answer.status, answer.result.state) == (0, "")


def test_bytes_that_are_no_request(ros, caplog):
    """They get no answer, and the service stays."""
    key = ros.peer.key("/tcs/files", "tcs_msgs/srv/Call")
    for payload, attachment in ((b"", b""), (b"\xff" * 40, bytes(33)), (b"\0" * 8, b"short")):
        for reply in ros.peer.session.get(
            key, payload=payload, attachment=attachment, timeout=SECONDS
        ):
            assert reply.ok is None
    assert ros.peer.call("/tcs/files", "tcs_msgs/srv/Call").success


def test_domains(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert domain_of_environment() == 7
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    with pytest.raises(ServiceError, match="must be a number from 0 to 232"):
        domain_of_environment()
