"""Engines: the same scores by each of them, also if workers end or cannot be reached."""

import numpy as np
import pytest

from tcs.errors import TcsError, UnknownNameError
from tcs.kernel.problem import build_problem
from tcs.placement.scoring import engines
from tcs.placement.scoring.engines import (
    ENGINES,
    Dask,
    PackedWork,
    Part,
    Threads,
    Work,
    engine_named,
)
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.sweep import sweep

PART = 40


@pytest.fixture(scope="module")
def lowered(small_job):
    return small_job.lowered(small_job.scene())


@pytest.fixture(scope="module")
def excluded(small_job):
    left_out = np.zeros(small_job.grid.size, dtype=np.bool_)
    left_out[10:60] = True
    return left_out


@pytest.fixture(scope="module")
def plain(lowered, small_job, excluded):
    return sweep(lowered, small_job.task.weights, excluded=excluded).tables[0]


@pytest.fixture(scope="module")
def work(lowered, excluded):
    problem = build_problem(lowered.arrays)
    return Work(Scorer.of(problem), lowered.grid, excluded)


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster of this process: real scheduler and workers, without processes to start."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=":0"
    ) as local:
        yield local


@pytest.fixture(params=ENGINES)
def engine(request):
    """Each engine."""
    if request.param == "dask":
        return Dask(request.getfixturevalue("cluster").scheduler_address, length=PART)
    return Threads(2, length=PART)


def test_every_engine_gives_the_same_bytes(engine, lowered, small_job, excluded, plain):
    done = []
    swept = sweep(
        lowered,
        small_job.task.weights,
        excluded=excluded,
        engine=engine,
        on_progress=lambda now, total: done.append((now, total)),
    ).tables[0]
    for name in ("reason", "dexterity", "pair", "arm_joints"):
        np.testing.assert_array_equal(getattr(swept, name), getattr(plain, name))
    assert swept.pair_names == plain.pair_names
    size = small_job.grid.size
    assert len(done) == -(-size // PART)
    assert done[-1] == (size, size)


def test_a_cluster_that_cannot_be_reached_is_told(monkeypatch, work):
    monkeypatch.setattr(engines, "TIMEOUT", 0.5)
    for address in ("tcp://127.0.0.1:9", "no address"):
        with pytest.raises(TcsError, match="cannot be reached"):
            list(Dask(address).scored(work, [Part(0, PART)]))


def test_a_cluster_without_workers_is_told(monkeypatch, work):
    from distributed import LocalCluster

    monkeypatch.setattr(engines, "TIMEOUT", 0.5)
    with (
        LocalCluster(n_workers=0, processes=False, dashboard_address=":0") as empty,
        pytest.raises(TcsError, match="has no worker"),
    ):
        list(Dask(empty.scheduler_address).scored(work, [Part(0, PART)]))


def test_a_cluster_that_is_lost_is_told(work):
    from distributed import LocalCluster

    parts = [Part(start, start + 1) for start in range(PART)]
    with LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as brief:
        found = Dask(brief.scheduler_address).scored(work, parts)
        next(found)
        brief.close()
        with pytest.raises(TcsError, match="with --blocks it continues where it was"):
            list(found)


def test_another_kernel_is_refused(work):
    packed = PackedWork.of(work)
    with pytest.raises(TcsError, match="another kernel"):
        packed._replace(kernel="0").unpacked()
    with pytest.raises(TcsError, match="damaged grid"):
        packed._replace(content=packed.content + b"\0").unpacked()


def test_engines_by_name():
    assert engine_named("threads", jobs=2) == Threads(2)
    assert engine_named("dask", jobs=2, scheduler="tcp://a:1") == Dask("tcp://a:1")
    with pytest.raises(UnknownNameError, match="unknown engine 'thread'"):
        engine_named("thread", jobs=2)
    with pytest.raises(TcsError, match="requires --scheduler ADDRESS"):
        engine_named("dask", jobs=2)
    with pytest.raises(TcsError, match="has no scheduler"):
        engine_named("threads", jobs=2, scheduler="tcp://a:1")
    with pytest.raises(TcsError, match="jobs is 0"):
        Threads(0)
