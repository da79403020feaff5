"""Every row of Table I: without error, evaluations equal the offline scores, goal by goal."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.scene import ErrorDistribution
from tcs.placement.robustness import Trials, evaluate
from tcs.placement.scoring import score, task_environment_pairs

NOTHING = {
    "bed": {"person_x": ErrorDistribution(distribution="normal", std=0.0)},
    "wheelchair": {
        "wheelchair_yaw": ErrorDistribution(distribution="normal", std_deg=0.0),
        "head_tilt": ErrorDistribution(distribution="uniform", half_width_deg=0.0),
    },
}


@pytest.mark.slow
@pytest.mark.parametrize(("task", "environment"), task_environment_pairs())
def test_without_error_every_row_gives_its_offline_score(task, environment, rng):
    file = score(task, environment, paper=True)
    trials = Trials.of(file, errors=NOTHING[environment.split("-")[0]])
    sets = file.nominal.sets
    for select in ("best", "single"):
        found = evaluate(trials, samples=2, select=select)
        assert np.all(found.fractions == found.reachability)
    members = rng.choice(sets.candidates, 200, replace=False)
    reached = trials.reached(members, trials.errors.draw(1, 0))[:, 0]
    assert np.array_equal(reached, sets.reached[np.searchsorted(sets.candidates, members)])
    # Configurations with a blocked base reach nothing offline, nor here if the base is checked.
    everywhere = rng.choice(trials.job.grid.size, 2000, replace=False)
    checked = Trials.of(file, errors=trials.errors.errors, body_collisions="all")
    again = checked.reached(everywhere, trials.errors.draw(1, 0))[:, 0]
    assert np.array_equal(again, file.nominal.scores.reached[everywhere])
