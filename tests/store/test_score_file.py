import dataclasses

import numpy as np
import pytest

from tcs.errors import GridError, StoreError, StoreMismatchError
from tcs.store import check_scene
from tests.store.example import METADATA, score_file
from tests.tables.small import random_scores, small_grid


def test_later_changes_outside_do_not_reach_the_file():
    metadata = dict(METADATA)
    file = score_file(metadata=metadata)
    metadata["task"] = "feeding"
    assert file.metadata["task"] == "shaving"


@pytest.mark.parametrize("key", METADATA)
def test_metadata_must_be_complete(key):
    partial = {name: value for name, value in METADATA.items() if name != key}
    with pytest.raises(StoreError, match=f"metadata needs '{key}'"):
        score_file(metadata=partial)


def test_parts_must_belong_together():
    file = score_file()
    with pytest.raises(StoreError, match="do not belong to a grid of 240"):
        score_file(grid=small_grid(nx=6, ny=5, bed=2), scores=file.scores, sets=file.sets)
    others = random_scores(small_grid(nx=6, ny=4, bed=2), 5, seed=2)
    with pytest.raises(StoreError, match="sets do not belong to the scores"):
        score_file(scores=others, sets=file.sets)
    moved = dataclasses.replace(file.sets, cell_xy=file.sets.cell_xy + np.array([0.0, 0.05]))
    with pytest.raises(StoreError, match="not those of the grid"):
        score_file(sets=moved)
    with pytest.raises(GridError):
        dataclasses.replace(file, grid={})


def test_other_models_are_told():
    file = score_file()
    check_scene(file, METADATA["scene_digest"])
    with pytest.raises(StoreMismatchError, match=r"'shaving' were made by tcs 0\.1\.0 from other"):
        check_scene(file, "00" * 32)
