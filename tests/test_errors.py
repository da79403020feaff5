import inspect
import re

import pytest

import tcs.errors
from tcs.errors import TcsError, UnknownNameError

CLASSES = [
    value
    for name, value in inspect.getmembers(tcs.errors, inspect.isclass)
    if value.__module__ == "tcs.errors" and not name.startswith("_")
]


def drawn_parents() -> dict[str, str | None]:
    """Return each class in the tree of the module docstring, with its parent class."""
    parents: dict[str, str | None] = {}
    above: list[tuple[int, str]] = []
    for line in (tcs.errors.__doc__ or "").splitlines():
        match = re.match(r"^([ │├└─]*)([A-Z]\w*Error)\b", line)
        if not match:
            continue
        depth, name = len(match[1]), match[2]
        while above and above[-1][0] >= depth:
            above.pop()
        parents[name] = above[-1][1] if above else None
        above.append((depth, name))
    return parents


def test_tree_in_the_docstring_is_the_real_one():
    real = {
        error.__name__: None if error is TcsError else error.__base__.__name__ for error in CLASSES
    }
    assert drawn_parents() == real


@pytest.mark.parametrize("error", CLASSES, ids=lambda error: error.__name__)
def test_one_root_catches_every_error(error):
    assert issubclass(error, TcsError)


def test_an_unknown_name_lists_the_known_ones_and_the_nearest():
    error = UnknownNameError("frame", "haed", ["torso", "head"], where="goal 3 of task 'shaving'")
    assert str(error) == (
        "goal 3 of task 'shaving': unknown frame 'haed'. Known: head, torso. Did you mean 'head'?"
    )
    assert (error.what, error.name, error.known) == ("frame", "haed", ("head", "torso"))


def test_an_unknown_name_suggests_no_distant_name():
    message = str(UnknownNameError("frame", "xyz", ["head"]))
    assert message == "unknown frame 'xyz'. Known: head."


def test_of_many_known_names_the_most_alike_are_listed():
    """A robot has a hundred joints, and a message is read in a terminal."""
    known = [f"{side}_{part}_{i}" for side in ("left", "right") for part in "ab" for i in range(30)]
    error = UnknownNameError("joint", "left_a_07", known)
    assert error.known == tuple(sorted(known))
    message = str(error)
    assert message.endswith(" and 110 others. Did you mean 'left_a_7'?")
    listed = message.partition("Known: ")[2].partition(" and ")[0].split(", ")
    assert len(listed) == 10
    assert "left_a_7" in listed
    assert not any("right" in name for name in listed)


def test_unknown_name_where_nothing_is_known():
    assert str(UnknownNameError("task", "shaving", [])) == "unknown task 'shaving'. Known: none."
