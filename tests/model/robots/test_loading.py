"""Robot files that are based on others."""

import pytest
import yaml

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots import load_robot


def write(folder, stem, /, **content):
    path = folder / f"{stem}.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_a_file_inherits_missing_fields(tmp_path, pr2):
    mine = load_robot(write(tmp_path, "mine", based_on="pr2", name="mine", gripper="closed"))
    assert (mine.name, mine.gripper) == ("mine", "closed")
    taken = {"name", "gripper"}
    assert mine.model_dump(exclude=taken) == pr2.model_dump(exclude=taken)
    # Paths are relative to the file that contains them.
    write(tmp_path, "again", based_on="./mine.yaml", name="again")
    assert load_robot(tmp_path / "again.yaml").load_primitives() == pr2.load_primitives()


def test_missing_or_circular_bases_are_refused(tmp_path):
    with pytest.raises(UnknownNameError, match=r"based_on.*Did you mean 'pr2'"):
        load_robot(write(tmp_path, "mine", based_on="pr3", name="mine"))
    write(tmp_path, "one", based_on="./two.yaml")
    with pytest.raises(RobotError, match="is based on this file in turn"):
        load_robot(write(tmp_path, "two", based_on="./one.yaml"))
    with pytest.raises(RobotError, match="cannot be read"):
        load_robot(write(tmp_path, "mine", based_on="./gone.yaml", name="mine"))
    with pytest.raises(UnknownNameError, match=r"'based_om'.*'based_on'"):
        load_robot(write(tmp_path, "mine", based_om="pr2"))
