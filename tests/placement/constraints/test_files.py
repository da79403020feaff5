import pytest

from tcs.errors import TcsError
from tcs.placement.constraints import Constraints, Obstacle, Region, merged, read_constraints

TEXT = """
only: ["head_rest >= 35 deg"]
keep: [bed_height]
forbid:
  - "0 -2, 2 -2, 2 -1"
  - [[0, 2], [2, 2], [2, 1.5]]
blocked: ["1 1 0.4 0.4"]
prefer: [left]
"""


def test_every_key_is_read(tmp_path):
    path = tmp_path / "ward.yaml"
    path.write_text(TEXT)
    found = read_constraints(path)
    assert found == Constraints(
        only=("head_rest >= 35 deg",),
        keep=("bed_height",),
        forbid=(Region.parse("0 -2, 2 -2, 2 -1"), Region.parse("0 2, 2 2, 2 1.5")),
        blocked=(Obstacle.parse("1 1 0.4 0.4"),),
        prefer=("left",),
    )
    more = merged(found, Constraints(keep=("torso",), prefer=("head",)))
    assert (more.keep, more.prefer) == (("bed_height", "torso"), ("left", "head"))
    assert more.forbid == found.forbid


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "onyl: [torso = 0]",
            "unknown key 'onyl'. Known: blocked, forbid, keep, only, prefer. Did",
        ),
        ("keep: bed_height", "'keep' must be a list"),
        ("keep: [1]", "'keep' holds 1; must be a text"),
        ("only: [high]", "Condition 'high' is not of the form"),
        ("forbid: [5]", "'forbid': 5 must be a list of [x, y]"),
        ("blocked: [a chair]", "four to seven numbers"),
        ("prefer: [window]", "must be a side of the person"),
        ("only: [", "is not valid YAML"),
        ("5", "must contain keys and values: only, keep, forbid, blocked, prefer"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, text, message):
    path = tmp_path / "ward.yaml"
    path.write_text(text)
    with pytest.raises(TcsError) as caught:
        read_constraints(path)
    assert message in str(caught.value)
    assert "ward.yaml" in str(caught.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(TcsError, match=r"absent\.yaml"):
        read_constraints(tmp_path / "absent.yaml")
