"""Many threads and processes on one file or one scene: the same answers as alone."""

import hashlib
import json
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import pytest

import tcs
from tcs.model.grid import InitialConfiguration
from tcs.placement.scoring import LiveScorer
from tests.environments import CORNER, write_environment

THREADS, PROCESSES = 16, 4
PLACES = [(1.0 + 0.1 * i, -1.0 + 0.05 * i, 0.2 * i) for i in range(THREADS)]


def digest(file):
    """Return a hash of the scores."""
    scores = file.nominal.scores
    arrays = (scores.reason, scores.dexterity, scores.pair, scores.arm_joints)
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


def answer(file, place):
    """Return what a user learns at a place: the chosen set, a reason, and the scores' hash."""
    x, y, yaw = place
    here = InitialConfiguration(base_x=x, base_y=y, base_yaw=yaw, torso=0.1)
    choice = tcs.select(file, here)
    explained = tcs.explain(file, 0, int(20 * x) % file.nominal.scores.configurations)
    return json.dumps(
        [untimed(choice.to_json(measure="isotropy")), untimed(explained.to_json()), digest(file)]
    )


def untimed(entry):
    return str({key: value for key, value in entry.items() if key != "seconds"})


def answer_from(path, place):
    return answer(tcs.load(path), place)


@pytest.fixture(scope="module")
def path(small_file, tmp_path_factory):
    path = tmp_path_factory.mktemp("shared") / "shared.tcs"
    tcs.save(path, small_file)
    return path


@pytest.fixture(scope="module")
def alone(path):
    file = tcs.load(path)
    return [answer(file, place) for place in PLACES]


def test_threads_on_one_loaded_file(path, alone):
    for _ in range(3):
        file = tcs.load(path)  # Nothing of it is decoded yet.
        with ThreadPoolExecutor(THREADS) as pool:
            assert list(pool.map(partial(answer, file), PLACES)) == alone


@pytest.mark.slow
def test_processes_on_one_file(path, alone):
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as pool:
        assert list(pool.map(partial(answer_from, path), PLACES)) == alone


def test_threads_on_one_live_scorer(tmp_path_factory):
    scorer = LiveScorer(
        "shaving",
        write_environment(tmp_path_factory.mktemp("live"), "live", CORNER),
        paper=True,
    )
    observed = [{"person_y": 0.008 * i} for i in range(-4, 4)]
    alone = [digest(scorer.score(one)) for one in observed]
    assert len(set(alone)) > len(alone) / 2
    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(lambda one: digest(scorer.score(one)), observed)) == alone
