from __future__ import annotations

import pytest

from tcs.errors import RobotError
from tcs_studies.experiment.maps import check_map_robot


def test_a_robot_without_a_head_is_refused_as_documented(iiwa):
    assert "RobotError" in check_map_robot.__doc__
    with pytest.raises(RobotError, match=r"'iiwa7'.*head"):
        check_map_robot(iiwa)
