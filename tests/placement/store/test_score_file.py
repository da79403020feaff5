import copy
import dataclasses
import pickle

import joblib
import numpy as np
import pytest

from tcs.errors import GridError, StoreError
from tcs.output.words import person_text
from tcs.placement.store import StateTables, load_scores, save_scores
from tests.placement.store.example import METADATA, SHIFT, score_file
from tests.placement.tables.small import random_scores, small_grid


def test_later_changes_outside_do_not_reach_the_file():
    metadata = dict(METADATA)
    file = score_file(metadata=metadata)
    metadata["task"] = "feeding"
    assert file.metadata["task"] == "shaving"


PERSON = {
    "given": {"sex": "female", "age": 6},
    "sex": "female",
    "age": 6,
    "stature": 1.16,
    "stature_percentile": 50.0,
    "mass": 20.5,
    "mass_percentile": 50,
    "posture": {"name": None, "angles_deg": {"head_turn": 30}},
    "touching_goals": [{"goal": 0, "name": None, "part": "person::head"}],
}


@pytest.mark.parametrize("key", PERSON)
@pytest.mark.parametrize("value", [None, "x", [5], True])
def test_what_is_recorded_of_the_person_can_be_read(key, value):
    """Otherwise commands and the service would fail where they say for whom a file is scored."""
    good = score_file(metadata={**METADATA, "person": PERSON})
    assert person_text(good.metadata["person"]).startswith("a girl of 6 years")
    with pytest.raises(StoreError, match="metadata 'person' is malformed"):
        score_file(metadata={**METADATA, "person": {**PERSON, key: value}})


def test_the_frame_of_a_goal_is_text():
    task = {"name": "shaving", "goals": [{"body_frame": []}] * 5}
    with pytest.raises(StoreError, match="'body_frame' of each goal"):
        score_file(task=task)


@pytest.mark.parametrize("key", METADATA)
def test_metadata_must_be_complete(key):
    partial = {name: value for name, value in METADATA.items() if name != key}
    with pytest.raises(StoreError, match=f"metadata needs '{key}'"):
        score_file(metadata=partial)


def test_parts_must_belong_together():
    file = score_file()
    table = file.nominal
    with pytest.raises(StoreError, match="more configurations than the grid has, 96"):
        dataclasses.replace(file, grid=small_grid(nx=6, ny=4).to_dict(), body_frames={})
    others = random_scores(small_grid(nx=6, ny=4, bed=2), 5, seed=2)
    with pytest.raises(StoreError, match="sets do not belong to the scores"):
        StateTables.of(others, table.sets)
    moved = dataclasses.replace(table.sets, cell_xy=table.sets.cell_xy + np.array([0.0, 0.2]))
    with pytest.raises(StoreError, match="not those of the grid"):
        dataclasses.replace(file, tables=(StateTables.of(table.scores, moved),))
    with pytest.raises(GridError):
        dataclasses.replace(file, grid={})


@pytest.fixture(params=["built", "loaded"])
def file(request, tmp_path):
    built = score_file(tables=2, observed=[SHIFT | {"count": 2}], options={"max_members": 3})
    if request.param == "built":
        return built
    save_scores(tmp_path / "scores.tcs", built)
    return load_scores(tmp_path / "scores.tcs")


def assert_same(one, other):
    assert one.metadata == other.metadata
    assert one.observed_states == other.observed_states
    for ours, theirs in zip(one.tables, other.tables, strict=True):
        for of in ("scores", "sets"):
            table, copied = getattr(ours, of), getattr(theirs, of)
            for field in dataclasses.fields(table):
                value = getattr(copied, field.name)
                if isinstance(value, np.ndarray):
                    np.testing.assert_array_equal(getattr(table, field.name), value)
                    assert not value.flags.writeable


COPIES = {
    "pickle": lambda file: pickle.loads(pickle.dumps(file)),
    "copy": copy.copy,
    "deep copy": copy.deepcopy,
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_file_can_be_pickled_and_copied(file, copied):
    assert_same(file, copied(file))


def best_of(file):
    scores = file.nominal.scores
    return file.nominal.sets.best, int(scores.reached.sum()), scores.reason.flags.writeable


def test_a_file_can_be_sent_to_another_process(file):
    (found,) = joblib.Parallel(n_jobs=2, backend="loky")([joblib.delayed(best_of)(file)])
    assert found == best_of(file)
    assert found[-1] is False
