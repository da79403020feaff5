"""What clients send and is refused: one line, and nothing of it stays."""

from __future__ import annotations

import threading
from pathlib import Path

import joblib
import pytest

from tcs.errors import DataFileError, ServiceError, StoreError
from tcs.files.compression import decoded_bytes
from tcs.files.joblib_file import write_joblib
from tcs.placement.store import save_scores
from tcs.placement.store.encoding import encode
from tcs.service import Engine, Limits, ScoreRequest, SelectRequest
from tcs.service.score_files import ScoreFiles
from tcs.service.sent_documents import SentDocuments
from tcs.service.worker import WorkerPool
from tests.placement.store.example import METADATA, score_file
from tests.placement.tables.small import small_grid


@pytest.fixture(scope="module")
def engine():
    with Engine(Limits(parse_seconds=60.0)) as engine:
        yield engine


def files_of(engine):
    folder = engine._files._folder
    return [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("person", [5, {"sex": "female"}, {"sex": []}, {"sex": "x", "mass": 1}])
def test_a_malformed_person_is_refused_and_its_file_removed(engine, tmp_path, person):
    path, content = tmp_path / "person.tcs", encode(score_file())
    content["metadata"] = {**METADATA, "person": person}
    write_joblib(path, content, "Score file")
    with pytest.raises(StoreError, match="metadata 'person' is malformed"):
        engine.add_file(path.read_bytes())
    assert engine.files() == []
    assert files_of(engine) == []


def test_a_file_that_takes_too_much_memory_is_refused_before_it_is_decoded(tmp_path):
    path = tmp_path / "large.tcs"
    save_scores(path, score_file())
    with Engine(Limits(decoded_bytes=10_000)) as engine:
        with pytest.raises(StoreError, match=r"that was sent: takes .* bytes of memory; at most"):
            engine.add_file(path.read_bytes())
        assert engine.files() == []
        # What the service itself has made, or was named when it started, is used as it is.
        assert engine.select(SelectRequest(file=engine.open_file(path).file))["members"]


def test_a_file_is_read_again_under_the_same_check(engine, tmp_path):
    path = tmp_path / "small.tcs"
    save_scores(path, score_file())
    held = engine._files.held(engine.add_file(path.read_bytes()).file)
    save_scores(held.path, score_file(grid=small_grid(nx=9, ny=9, bed=2)))
    small = Limits(decoded_bytes=decoded_bytes(joblib.load(path), narrow=()))
    files = ScoreFiles(tmp_path, small, WorkerPool(0, memory=0))
    files.lend(held)
    with pytest.raises(StoreError, match="bytes of memory; at most"):
        files.loaded(held.entry.file)


def test_files_are_listed_while_the_content_of_one_is_read(engine, tmp_path, monkeypatch):
    path = tmp_path / "small.tcs"
    save_scores(path, score_file())
    file, listed = engine.open_file(path).file, []

    def read_bytes(_path):
        listing = threading.Thread(target=lambda: listed.extend(engine.files()), daemon=True)
        listing.start()
        listing.join(5.0)
        return b"content"

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", read_bytes)
        assert engine.content_of(file) == b"content"
    assert file in [entry.file for entry in listed]


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
