import dataclasses

import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.placement.tables import BaseLattice, SetTable
from tcs.placement.tables.sets import Groups

NO_MOVES = BaseLattice(start=(0.0, 0.0), step=(0.5, 0.5), moves=np.zeros((4, 2, 2), dtype=np.bool_))


def parts():
    """Three candidates at two base positions 0.5 m apart; only the pair (4, 7) is kept."""
    return {
        "rule": "paper",
        "max_members": 2,
        "min_distance": 0.4,
        "same_environment": False,
        "state_size": 5,
        "weights": np.array([0.5, 0.5]),
        "candidates": np.array([4, 5, 7], dtype=np.int32),
        "reached": np.array([[True, False], [True, False], [False, True]]),
        "dexterity": np.array([[0.5, 0.0], [0.0, 0.0], [0.0, 0.25]], dtype=np.float32),
        "cell": np.array([0, 0, 1], dtype=np.int32),
        "cell_xy": np.array([[0.0, 0.0], [0.5, 0.0]]),
        "pairs": Groups(
            cells=np.array([[0, 1]], dtype=np.int32),
            count=np.array([1]),
            reachability=np.array([1.0]),
            manipulability=np.array([0.375], dtype=np.float32),
            total=np.array([1.375], dtype=np.float32),
            member_reachability=np.array([1.0, 0.0, 1.0]),
            member_manipulability=np.array([0.375, 0.0, 0.375], dtype=np.float32),
            member_total=np.array([1.375, 0.0, 1.375], dtype=np.float32),
        ),
        "triples": None,
        "best": (4, 7),
        "best_single": (4,),
        "lattice": NO_MOVES,
    }


def test_counts_and_scores():
    sets = SetTable(**parts())
    assert (sets.kept_pairs, sets.sets) == (1, 4)
    assert sets.limits.manipulability == np.nextafter(0.25, 1.0)
    assert sets.state.tolist() == [0, 1, 1]
    assert sets.scores_of((4, 7)) == (1.0, 0.375)
    assert sets.scores_of((5,)) == (0.5, 0.0)
    np.testing.assert_array_equal(sets.by_cell, [0, 1, 2])
    np.testing.assert_array_equal(sets.cell_start, [0, 2, 3])


@pytest.mark.parametrize("members", [(), (3,), (6,), (8,), (4, 6), (-1,)])
def test_scores_of_something_else_are_refused(members):
    with pytest.raises(TcsError, match="every member must be a configuration that reaches a goal"):
        SetTable(**parts()).scores_of(members)


def test_arrays_are_read_only():
    sets = SetTable(**parts())
    for field in dataclasses.fields(sets):
        array = getattr(sets, field.name)
        if isinstance(array, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0


WRONG = {
    "rule": ({"rule": "mine"}, "unknown rule 'mine'. Known: paper"),
    "distance": ({"min_distance": -0.1}, "min_distance"),
    "distance nan": ({"min_distance": float("nan")}, "min_distance"),
    "members": ({"max_members": 0}, "max_members"),
    "states": ({"state_size": 0}, "state_size"),
    "lattice": ({"lattice": None}, "lattice must be a BaseLattice"),
    "candidates": ({"candidates": np.array([4, 4, 7], dtype=np.int32)}, "ascending"),
    "negative candidate": ({"candidates": np.array([-4, 4, 7], dtype=np.int32)}, "ascending"),
    "cell": ({"cell": np.array([0, 0, 2], dtype=np.int32)}, r"cell outside 0\.\.1"),
    "empty cell": ({"cell": np.array([0, 0, 0], dtype=np.int32)}, "a cell has no candidate"),
    "cell_xy": ({"cell_xy": np.array([[0.0, np.nan], [0.5, 0.0]])}, "finite"),
    "pairs": ({"pairs": None}, "pairs must be groups of two"),
    "type": ({"dexterity": np.zeros((3, 2))}, "float32"),
    "best": ({"best": (4, 6)}, "best must name"),
    "best of three": ({"best": (4, 5, 7)}, "best must name"),
    "no best": ({"best_single": ()}, "best_single must name"),
    "best single of two": ({"best_single": (4, 7)}, "best_single must name"),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG.keys())
def test_refuses(changes, message):
    with pytest.raises(TcsError, match=message):
        SetTable(**(parts() | changes))
