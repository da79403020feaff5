"""Semantic requests: robot and person from tf, the set of the service, in the units of ROS."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.errors import DataFileError, NotFoundError, ServiceError, TcsError
from tcs.placement.store import save_scores
from tcs.service import Engine, SelectRequest
from tcs.service.ros import FrameNames, Placer, PlaceRequest, Pose, TransformTree
from tests.placement.store.example import score_file

REQUEST = PlaceRequest(task="shaving", settings={"bed_height": 0.0})
YAW = 2.5
X_ME = Pose.of_quaternion(
    np.array([3.0, -1.0, 0.0]), np.array([0, 0, math.sin(0.4), math.cos(0.4)])
)
X_EB = Pose.of_quaternion(
    np.array([1.4, -1.2, 0.0]), np.array([0, 0, math.sin(YAW / 2), math.cos(YAW / 2)])
)


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    path = tmp_path_factory.mktemp("placing") / "small.tcs"
    save_scores(path, score_file())
    with Engine() as engine:
        engine.open_file(path)
        yield engine


@pytest.fixture
def tree():
    tree = TransformTree(max_age=5.0)
    tree.set("map", "environment", X_ME, is_static=True)
    tree.set("map", "base_footprint", X_ME @ X_EB, is_static=False)
    return tree


def test_the_set_is_that_of_select_from_the_base_of_tf(engine, tree):
    request = replace(REQUEST, torso_height=0.1, options='{"beta": 0.5, "max_members": 1}')
    placement = Placer(engine, tree, FrameNames()).place(request)
    expected = engine.select(
        SelectRequest(
            file=placement.file, here=(1.4, -1.2, math.degrees(YAW)), torso=0.1,
            at={"bed_height": 0.0}, beta=0.5, max_members=1,
        )
    )  # fmt: skip
    assert placement.choice["members"] == expected["members"]
    assert placement.choice["cost"] == pytest.approx(expected["cost"])
    for stop, member in zip(placement.stops, expected["members"], strict=True):
        assert (stop.x, stop.y, stop.torso) == tuple(
            member[name] for name in ("base_x", "base_y", "torso")
        )
        assert stop.yaw == pytest.approx(math.radians(member["base_yaw_deg"]))
        assert stop.settings == {"bed_height": member["bed_height"]}


def test_settings_in_radians(engine, tree):
    """Axes in degrees are sent in radians, as everything of ROS."""
    placer = Placer(engine, tree, FrameNames())
    entry = engine.files()[0]
    assert entry.settings == ["bed_height"]
    from tcs.service.ros.placing import _settings_in

    tilted = entry.model_copy(update={"settings": ["bed_height", "head_rest_deg"]})
    request = replace(REQUEST, settings={"bed_height": 0.1, "head_rest": math.pi / 2})
    assert _settings_in(tilted, request) == {"bed_height": 0.1, "head_rest_deg": 90.0}
    with pytest.raises(TcsError, match="bed_hieght"):
        placer.place(replace(REQUEST, settings={"bed_hieght": 0.1}))


def test_person_from_tf(engine, tree):
    entry = engine.files()[0]
    names = FrameNames(person={"head": "human/head"})
    placer = Placer(engine, tree, names)
    with pytest.raises(TcsError, match="unknown frame 'human/head'"):
        placer.place(REQUEST)
    asked = []

    class Recording:
        files = engine.files

        def select(self, request):
            asked.append(request)
            raise TcsError("recorded")

    p_EH = np.array([0.1, 0.2, 1.1])
    tree.set(
        "map", "human/head", X_ME @ Pose.of_quaternion(p_EH, np.array([0, 0, 0, 1.0])),
        is_static=False,
    )  # fmt: skip
    with pytest.raises(TcsError, match="recorded"):
        Placer(Recording(), tree, names).place(REQUEST)
    np.testing.assert_allclose(asked[0].frames["head"], p_EH, atol=1e-12)
    assert asked[0].file == entry.file


def test_requests_that_are_refused(engine, tree):
    placer = Placer(engine, tree, FrameNames())
    with pytest.raises(NotFoundError, match=r"no score file of task 'shavign' is held. Held: "):
        placer.place(replace(REQUEST, task="shavign"))
    with pytest.raises(DataFileError, match="options: 'here' is a field"):
        placer.place(replace(REQUEST, options='{"here": [0, 0, 0]}'))
    with pytest.raises(DataFileError, match="options is not valid JSON"):
        placer.place(replace(REQUEST, options="{"))
    with pytest.raises(TcsError, match="options: unknown key 'betta'"):
        placer.place(replace(REQUEST, options='{"betta": 1}'))
    with pytest.raises(ServiceError, match="needs a frame of the person"):
        placer.place(replace(REQUEST, score_scene=True))


def test_the_newest_file_of_one_scene_is_taken(engine, tree):
    entry = engine.files()[0]
    others = [entry.model_copy(update={"file": digit * 64, "robot": "tiago"}) for digit in "ab"]

    class Held:
        def files(self):
            return [entry, *others]

        def select(self, request):
            raise TcsError(request.file)

    placer = Placer(Held(), tree, FrameNames())
    with pytest.raises(ServiceError, match="several score files are of task 'shaving'"):
        placer.place(REQUEST)
    with pytest.raises(TcsError, match="b" * 64):
        placer.place(replace(REQUEST, robot="tiago"))
