"""Processes for what clients send: limits of time and memory, and what they leave behind."""

from __future__ import annotations

import os
import time

import pytest

from tcs.errors import CancelledError, DataFileError, ServiceError, UnknownNameError
from tcs.service.worker import Worker, report


@pytest.fixture(scope="module")
def worker():
    worker = Worker(memory=200 * 1024**2)
    yield worker
    worker.close()


def size_of(count: int) -> int:
    return len(bytearray(count))


def nap(seconds: float) -> None:
    report("begun")
    time.sleep(seconds)


def count() -> None:
    while True:
        report("counted")
        time.sleep(0.01)


def unknown() -> None:
    raise UnknownNameError("task", "shavign", ["shaving"], where="request")


def test_a_call_is_made_in_another_process_that_is_kept(worker):
    first = worker.call(os.getpid, seconds=60)
    assert first != os.getpid()
    assert worker.call(os.getpid, seconds=60) == first


def test_memory_is_limited_and_the_next_call_is_made(worker):
    assert worker.call(size_of, 50 * 1024**2, seconds=60) == 50 * 1024**2
    with pytest.raises(ServiceError, match="the request takes more memory than 209,715,200 bytes"):
        worker.call(size_of, 400 * 1024**2, seconds=60)
    assert worker.call(size_of, 1, seconds=60) == 1


def test_time_is_limited_and_the_process_is_ended(worker):
    process = worker.call(os.getpid, seconds=60)
    begun = time.monotonic()
    with pytest.raises(ServiceError, match=r"the request takes longer than 0\.3 s"):
        worker.call(nap, 60.0, seconds=0.3)
    assert time.monotonic() - begun < 30.0
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def cancelled(worker, function, *arguments):
    """Cancel a call once it has reported; return what it reported."""
    reported = []

    def look():
        if reported:
            raise CancelledError("the job was cancelled.")

    with pytest.raises(CancelledError, match="the job was cancelled"):
        worker.call(function, *arguments, seconds=60, on_report=reported.append, look=look)
    return reported


def test_a_call_that_is_cancelled_ends_where_it_next_reports(worker):
    # Scenes that the process keeps are not built again.
    process = worker.call(os.getpid, seconds=60)
    assert set(cancelled(worker, count)) == {"counted"}
    assert worker.call(os.getpid, seconds=60) == process


def test_a_cancelled_call_that_does_not_end_is_ended_with_its_process(worker, monkeypatch):
    monkeypatch.setattr("tcs.service.worker._GRACE", 0.1)
    process = worker.call(os.getpid, seconds=60)
    assert cancelled(worker, nap, 60.0) == ["begun"]
    assert worker.call(os.getpid, seconds=60) != process


def test_errors_are_those_of_the_function(worker):
    with pytest.raises(UnknownNameError, match=r"^request: unknown task 'shavign'.*Did you mean"):
        worker.call(unknown, seconds=60)
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        worker.call(divmod, 1, 0, seconds=60)
    from tcs.service import SelectRequest
    from tcs.service.sent_documents import request_of

    with pytest.raises(DataFileError, match="request is not valid JSON"):
        worker.call(request_of, SelectRequest, b"[", seconds=60)
