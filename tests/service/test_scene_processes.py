"""Scenes are built, scored and posed in processes of their own."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tcs.placement.store import save_scores
from tcs.service import (
    Engine,
    EvaluateRequest,
    MotionsRequest,
    PlanRequest,
    PopulationRequest,
    PostureRequest,
    RefineRequest,
    RescoreRequest,
    SceneRequest,
    ScoreHereRequest,
    ScoreRequest,
)
from tcs.service.scene_processes import _Done
from tcs.service.worker import Worker
from tests.placement.store.example import score_file

OF_FILES = (
    EvaluateRequest, MotionsRequest, PlanRequest, PopulationRequest, RefineRequest, RescoreRequest,
    SceneRequest,
)  # fmt: skip
HERE = (1.4, -1.2, 180.0)


@pytest.fixture
def engine(tmp_path):
    path = tmp_path / "small.tcs"
    save_scores(path, score_file())
    with Engine() as engine:
        engine.open_file(path)
        yield engine


@pytest.fixture
def called(monkeypatch):
    """Works that processes are asked for; nothing is done."""
    called = []

    def call(worker, _function, name, *_arguments, **_options):
        called.append((worker, name))
        return _Done(json.dumps({"text": "done"}), (), None)

    monkeypatch.setattr(Worker, "call", call)
    return called


def test_no_scene_is_built_where_requests_are_answered(engine, called):
    file = engine.files()[0].file
    jobs = [model(file=file) for model in OF_FILES]
    jobs += [model(task="shaving") for model in (ScoreRequest, ScoreHereRequest)]
    for request in jobs:
        assert engine.wait(engine.submit(request).job).result == {"text": "done"}
    of_jobs = {worker for worker, _ in called}
    assert {what for _, what in called} == {engine.job(one.job).what for one in engine.jobs()}
    assert len(of_jobs) == 1
    called.clear()
    # Who looks at a scene does not wait for a job.
    engine.posture(PostureRequest(file=file, here=HERE))
    assert engine.environment_of(file) == "done"
    assert [what for _, what in called] == ["posture", "environment"]
    assert not of_jobs & {worker for worker, _ in called}


def test_what_clients_describe_has_a_process_of_its_own(engine, called):
    described = {"environment_yaml": "based_on: wheelchair\nname: x\n"}
    for fields in ({}, described):
        request = ScoreRequest(task="shaving", **fields)
        assert engine.wait(engine.submit(request).job).state == "done"
    assert len({worker for worker, _ in called}) == 2


def test_the_service_loads_neither_drake_nor_what_draws():
    script = (
        "import sys; from tcs.service.http import make_application; from tcs.service import Engine"
        "; print([name for name in ('pydrake', 'matplotlib', 'tcs.model.scene') "
        "if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


# The process imports Drake and compiles or loads the kernel.
@pytest.mark.slow
def test_a_job_and_its_file_come_back_from_the_process(engine):
    request = ScoreRequest(task="shaving", only=["base_x < -0.5", "base_y < -0.5"])
    seen = []
    status = engine.wait(engine.submit(request).job, lambda *amounts: seen.append(amounts))
    assert status.problem is None
    assert seen[-1][0] == seen[-1][1]
    file = status.result["file"]
    assert file in [entry.file for entry in engine.files()]
    assert engine.posture(PostureRequest(file=file, here=(-0.6, -0.6, 0.0)))["shapes"]
    assert "wheelchair" in engine.environment_of(file)
