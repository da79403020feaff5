import numpy as np
import pytest

from tcs.errors import TcsError
from tcs.placement.tables import BaseLattice


def parts():
    moves = np.zeros((4, 2, 3), dtype=np.bool_)
    moves[0, 0, 1] = moves[3, 0, 1] = True
    return {"start": (0.0, 1.0), "step": (0.1, 0.2), "moves": moves}


def test_knows_its_shape_and_is_read_only():
    lattice = BaseLattice(**parts())
    assert lattice.shape == (2, 3)
    with pytest.raises(ValueError, match="read-only"):
        lattice.moves[0, 0, 0] = True


def leaving(step, i, j):
    moves = np.zeros((4, 2, 3), dtype=np.bool_)
    moves[step, i, j] = True
    return {"moves": moves}


WRONG = {
    "step": ({"step": (0.1, 0.0)}, "positive"),
    "start": ({"start": (0.0, float("nan"))}, "finite"),
    "integers": ({"start": (0, 1)}, "finite numbers"),
    "three types": ({"moves": np.zeros((3, 2, 3), dtype=np.bool_)}, "shape"),
    "a single row": ({"moves": np.zeros((4, 1, 3), dtype=np.bool_)}, "at least two"),
    "out along x": (leaving(0, 1, 0), "leaves the lattice"),
    "out along y": (leaving(1, 0, 2), "leaves the lattice"),
    "out at a corner": (leaving(2, 0, 2), "leaves the lattice"),
    "out at the other": (leaving(3, 0, 0), "leaves the lattice"),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG.keys())
def test_refuses(changes, message):
    with pytest.raises(TcsError, match=message):
        BaseLattice(**(parts() | changes))
