"""What the first job would wait for is done before, once, and hinders nothing."""

from __future__ import annotations

import threading

import httpx
import pytest

import tcs.placement.scoring
from tcs.errors import SelectionError
from tcs.placement.store import save_scores
from tcs.service import Engine
from tcs.service.http import Access, Server, make_application
from tcs.service.preparation import Preparation
from tcs.service.requests import ScoreHereRequest
from tests.placement.store.example import score_file

# What is built in the processes is put in its place here.
pytestmark = pytest.mark.usefixtures("in_process")


class Scorers:
    """Stands in for `tcs.LiveScorer`: counts what is built, and scores nothing."""

    def __init__(self, monkeypatch, *, compiles=False):
        self.built, self.compiles = [], compiles
        self.thinned: list[tuple] = []
        monkeypatch.setattr(tcs.placement.scoring, "LiveScorer", self)

    def __call__(self, task, environment, robot, *, on_compile, **_options):
        if self.compiles:
            on_compile()
        self.built.append((task, environment, robot))
        return self

    def score(self, _observation, *, every, around):
        self.thinned.append((every, around))
        raise SelectionError("scored")


def here(engine, **request):
    """Return the outcome of a job `score-here`."""
    status = engine.submit(ScoreHereRequest.model_validate({"task": "shaving", **request}))
    return engine.wait(status.job).problem


def test_the_first_job_finds_its_scene(monkeypatch):
    scorers = Scorers(monkeypatch)
    with Engine() as engine:
        engine.prepare().wait()
        assert scorers.built == [("shaving", "wheelchair", "pr2")]
        assert engine.prepare() is engine.prepare()
        assert here(engine, observed={"person_x": 0.01}) == "scored"
        assert here(engine, every=2, around=(0.5, 1.0)) == "scored"
        assert scorers.thinned == [(1, None), (2, (0.5, 1.0))]
        assert len(scorers.built) == 1
        assert here(engine, task="feeding") == "scored"
        assert scorers.built[1:] == [("feeding", "wheelchair", "pr2")]


def test_the_scene_is_that_of_the_first_file(monkeypatch, tmp_path):
    scorers = Scorers(monkeypatch)
    path = tmp_path / "example.tcs"
    file = score_file()
    save_scores(path, file)
    with Engine() as engine:
        engine.open_file(path)
        engine.prepare().wait()
    assert scorers.built == [tuple(file.metadata[k] for k in ("task", "environment", "robot"))]


def test_nothing_is_compiled_before_a_job_needs_it(monkeypatch):
    scorers = Scorers(monkeypatch, compiles=True)
    with Engine() as engine:
        engine.prepare().wait()
        assert scorers.built == []
        assert here(engine) == "scored"
        assert len(scorers.built) == 1


@pytest.mark.parametrize("error", [MemoryError, OSError, ImportError, RuntimeError])
def test_a_step_that_fails_is_the_last(error):
    done = []

    def fails():
        done.append("fails")
        raise error("too little")

    preparation = Preparation([fails, lambda: done.append("next")], lambda: done.append("ready"))
    preparation.wait()
    assert done == ["fails", "ready"]


def test_it_says_when_everything_is_done():
    done = []
    steps = [lambda: done.append("first"), lambda: done.append("second")]
    Preparation(steps, lambda: done.append("ready")).wait()
    assert done == ["first", "second", "ready"]


def test_it_stops_after_the_present_step():
    begun, may_end, done = threading.Event(), threading.Event(), []

    def slow():
        begun.set()
        may_end.wait(30.0)
        done.append("slow")

    preparation = Preparation([slow, lambda: done.append("next")], lambda: done.append("ready"))
    assert begun.wait(30.0)
    threading.Timer(0.1, may_end.set).start()
    preparation.stop()
    assert done == ["slow"]


def test_it_begins_once_requests_are_answered():
    answered, connected = threading.Event(), []

    def on_listening():
        def ask():
            connected.append(httpx.get(f"{server.url}/v1", timeout=30.0).status_code)
            answered.set()

        threading.Thread(target=ask).start()

    with Engine() as engine:
        server = Server(
            make_application(engine, Access()), host="127.0.0.1", port=0, on_listening=on_listening
        )
        assert not answered.wait(0.1)
        with server:
            assert answered.wait(30.0)
    assert connected == [200]
