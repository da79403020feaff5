"""Problems of people in a scene: the same as of the scene built with them."""

import numpy as np
import pytest

from tcs.kernel.problem import build_problem
from tcs.placement.population.outcomes import PersonProblems
from tcs.placement.scoring import load_job
from tests.environments import CORNER, write_environment


@pytest.mark.parametrize("robot", ["pr2", "stretch"])
def test_the_problem_of_the_papers_man_is_that_of_the_scene(robot, tmp_path):
    job = load_job("shaving", write_environment(tmp_path, "corner", CORNER), robot, paper=True)
    arrays = job.lowered(job.scene()).arrays
    # Paddings by which the shapes of the arm can be told apart.
    pad = np.linspace(0.0, 0.01, len(arrays.arm.pad))
    arrays = arrays._replace(arm=arrays.arm._replace(pad=pad))
    expected = build_problem(arrays)
    found = PersonProblems(arrays, "isotropy").of(arrays)
    clearances, goals = ("environment", "base", "widest", "arm_radius"), ("R", "p")
    for part, names in {
        "clearances": clearances,
        "environment": ("shapes",),
        "goals": goals,
    }.items():
        for name in names:
            values = (getattr(getattr(one, part), name) for one in (found, expected))
            np.testing.assert_array_equal(*values, f"{part}.{name}")
