"""Jobs that start from the sets of a file: the results of the public functions, and held files."""

from __future__ import annotations

import math

import pytest

import tcs
from tcs.errors import TcsError
from tcs.placement.selection import Executability
from tcs.service import Engine, MotionsRequest, PopulationRequest, RefineRequest, SelectRequest
from tests.environments import CORNER, write_environment

HERE = (1.4, -1.2, 180.0)
AT = tcs.InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=math.pi, torso=0.0)
# Scoring, refinement and the planner: half a minute. The work is done in a process of its own.
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A score file of shaving at a wheelchair with few base poses."""
    folder = tmp_path_factory.mktemp("sets")
    path = folder / "corner.tcs"
    tcs.save(path, tcs.score("shaving", write_environment(folder, "corner", CORNER), paper=True))
    return path


@pytest.fixture(scope="module")
def engine(path):
    with Engine() as engine:
        engine.open_file(path)
        yield engine


@pytest.fixture(scope="module")
def file(engine):
    return engine.files()[0].file


def done(engine, request):
    status = engine.wait(engine.submit(request).job)
    assert status.state == "done", status.problem
    return status.result


def test_population_is_that_of_the_library(engine, file, path):
    from tcs.model.people import draw_bodies

    result = done(engine, PopulationRequest(file=file, bodies=3, sets=2, seed=4))
    expected = tcs.population(tcs.load(path), draw_bodies(3, seed=4), top=tcs.Top(count=2), seed=4)
    assert {**result, "seconds": 0} == {**expected.to_json(), "seconds": 0}


def test_refined_file_is_held(engine, file, path):
    from tcs.placement.refinement import refinement_summary

    request = RefineRequest(file=file, starts=1, rounds=1, keep_success=False)
    result = done(engine, request)
    assert result["file"] != file
    assert result["file"] in [entry.file for entry in engine.files()]
    expected = tcs.refine(tcs.load(path), starts=1, rounds=1, keep_success=False)
    summary = refinement_summary(expected)
    assert result["scored"] == summary["scored"]
    choice = engine.select(SelectRequest(file=result["file"], here=HERE))
    assert choice["reachability"] == tcs.select(expected, AT).reachability


def test_motions_are_held_for_selection(engine, file, path):
    result = done(engine, MotionsRequest(file=file, most=2))
    assert result["configurations"] == 2
    assert result["file"] == file
    loaded = tcs.load(path)
    motions = tcs.examine(loaded, most=2)
    choice = tcs.select(loaded, AT, motions=motions)
    answer = engine.select(SelectRequest(file=file, here=HERE, executable=True))
    assert answer["members"] == [choice.members[i].to_json() for i in choice.order]
    compared = Executability.of(loaded, motions, choice, tcs.select(loaded, AT))
    assert answer["executable"] == compared.to_json(choice)


def test_motions_are_those_of_the_scores(engine, file, tmp_path):
    """A refined file is another file: the motions of its origin are not taken for it."""
    result = done(engine, RefineRequest(file=file, starts=1, rounds=1, keep_success=False))
    with pytest.raises(TcsError, match="no motions of this score file"):
        engine.select(SelectRequest(file=result["file"], here=HERE, executable=True))
