"""What clients send and is refused: one line, and nothing of it stays."""

from __future__ import annotations

import pytest

from tcs.errors import DataFileError, ServiceError, StoreError
from tcs.placement.store import save_scores
from tcs.service import Engine, Limits, ScoreRequest
from tcs.service.sent_documents import SentDocuments
from tests.placement.store.example import METADATA, score_file


@pytest.fixture(scope="module")
def engine():
    with Engine(Limits(parse_seconds=60.0)) as engine:
        yield engine


def files_of(engine):
    folder = engine._files._folder
    return [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("person", [5, {"sex": "female"}, {"sex": []}, {"sex": "x", "mass": 1}])
def test_a_malformed_person_is_refused_and_its_file_removed(engine, tmp_path, person):
    path = tmp_path / "person.tcs"
    save_scores(path, score_file(metadata={**METADATA, "person": person}))
    with pytest.raises(StoreError, match="metadata 'person' is malformed"):
        engine.add_file(path.read_bytes())
    assert engine.files() == []
    assert files_of(engine) == []


# The process imports Drake.
@pytest.mark.slow
def test_refused_documents_do_not_stay(engine):
    for text in ("name: [1", "name: x\nnmae: y\n", "based_on: /etc/passwd\n"):
        request = ScoreRequest(task="shaving", environment_yaml=text)
        assert engine.wait(engine.submit(request).job).state == "failed"
    assert files_of(engine) == []


def test_the_document_of_a_request_that_fails_is_removed(tmp_path):
    sent, request = SentDocuments(tmp_path), ScoreRequest(task_yaml="name: x")
    with pytest.raises(FileExistsError), sent.kept_if_used(request):
        sent.task(request.task_yaml).touch(exist_ok=False)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(DataFileError):
        sent.task("name: [1")
    assert list(tmp_path.iterdir()) == []


def test_the_oldest_documents_go_first(tmp_path):
    sent = SentDocuments(tmp_path, most=250)
    for number in range(4):
        request = ScoreRequest(task_yaml=f"name: task{number}\n" + "#" * 80)
        with sent.kept_if_used(request):
            sent.task(request.task_yaml)
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 250
    assert sent._path("task", request.task_yaml).exists()


def test_a_scene_that_takes_too_long_is_one_line():
    with Engine(Limits(job_seconds=0.5)) as engine:
        request = ScoreRequest(task="shaving", environment_yaml="based_on: wheelchair\nname: x\n")
        status = engine.wait(engine.submit(request).job)
        assert status.state == "failed"
        assert "0.5 s" in status.problem
        assert files_of(engine) == []
        with pytest.raises(ServiceError, match="'task' or 'task_yaml'"):
            engine.submit(ScoreRequest())
