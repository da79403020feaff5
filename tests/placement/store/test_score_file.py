import dataclasses

import numpy as np
import pytest

from tcs.errors import GridError, StoreError, StoreMismatchError
from tcs.placement.store import StateTables, check_scene
from tests.placement.store.example import METADATA, score_file
from tests.placement.tables.small import random_scores, small_grid


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


def test_other_models_are_told():
    file = score_file()
    check_scene(file, METADATA["scene_digest"])
    with pytest.raises(StoreMismatchError, match=r"'shaving' were made by tcs 0\.1\.0 from other"):
        check_scene(file, "00" * 32)
