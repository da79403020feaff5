"""Which set the engine selects: the recommended one, unless a weight is stated."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import tcs
from tcs.errors import ServiceError
from tcs.service import Engine, SelectRequest
from tests.placement.selection.test_estimated import estimated
from tests.placement.store.example import score_file

HERE = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    path = tmp_path_factory.mktemp("select") / "small.tcs"
    file = score_file(share=0.3)
    success = estimated(file.nominal.sets, np.random.default_rng(1))
    table = dataclasses.replace(file.nominal, success=success)
    tcs.save(path, dataclasses.replace(file, tables=(table,)))
    return path


@pytest.fixture(scope="module")
def engine():
    with Engine() as engine:
        yield engine


@pytest.mark.parametrize("here", [None, HERE], ids=["anywhere", "here"])
def test_the_most_robust_set_is_selected_unless_a_weight_is_stated(engine, scored, here):
    digest = engine.open_file(scored).file
    stated = {} if here is None else {"here": here}
    choice = engine.select(SelectRequest(file=digest, **stated))
    success = tcs.load(scored).nominal.success
    assert choice["basis"] == "success"
    assert choice["success_ci95"][0] == success.low.max()
    for name, default in (("alpha", 1.0), ("delta", 0.0), ("place_penalty", 0.01)):
        wished = engine.select(SelectRequest(file=digest, **stated, **{name: default}))
        assert wished["basis"] == "utility"


def test_a_state_without_the_base_pose_is_refused(engine, scored):
    digest = engine.open_file(scored).file
    with pytest.raises(ServiceError, match="'torso' and 'at' require 'here'"):
        engine.select(SelectRequest(file=digest, torso=0.1))
