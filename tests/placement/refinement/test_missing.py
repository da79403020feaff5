"""What is missing for goals that nothing reaches: Stretch ends below the top of a head."""

import math

import numpy as np
import pytest
import yaml

import tcs
from tcs.placement.refinement.missing import what_is_missing

HERE = ["base_x >= 0.3 m", "base_x <= 0.6 m", "base_y >= 0.4 m", "base_y <= 0.7 m"]
"""A few hundred configurations beside the person, fewer than are tried."""


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    """Scores the left side of the forehead alone, any way round, moved down [m] or tilted [rad]."""

    def score(lower=0.0, tilt=0.0):
        path = tmp_path_factory.mktemp("task") / "forehead.yaml"
        goal = {
            "name": "left side of the forehead",
            "body_frame": "head",
            "position": [0.098937, 0.162396, 0.116265 - lower],
            "quaternion_wxyz": [0.70153206, -0.16722301, 0.15069501, -0.67615106],
            "free": {"rotation_about": [1, 0, 0]},
        }
        if tilt:
            goal["free"]["cone"] = {"axis": [1, 0, 0], "half_angle_deg": math.degrees(tilt)}
        task = {"name": "forehead", "title": "Forehead", "source": "brushing", "goals": [goal]}
        path.write_text(yaml.safe_dump({**task, "environments": ["wheelchair"]}))
        return tcs.score(path, "wheelchair", "stretch", only=HERE, approach=False)

    return score


@pytest.fixture(scope="module")
def remedies(scored):
    """What is missing for the forehead."""
    file = scored()
    assert not file.nominal.scores.reached.any()
    assert file.configurations.size <= 400
    return {remedy.change: remedy for remedy in what_is_missing(file, 0)}


def test_it_is_reached_that_much_lower_and_not_higher(scored, remedies):
    lower = remedies["lower"].amount
    assert 0.005 < lower <= 0.16
    assert "higher" not in remedies
    # The head of the person who sits upright is level: its z is that of the environment.
    assert scored(lower).nominal.scores.reached.any()
    assert not scored(lower - 0.005).nominal.scores.reached.any()


def test_it_is_reached_tilted_that_much(scored, remedies):
    tilt = remedies["tilt"].amount
    assert scored(tilt=tilt).nominal.scores.reached.any()
    assert not scored(tilt=tilt - math.radians(2.0)).nominal.scores.reached.any()


def test_words_have_amounts_and_units(remedies):
    lower = remedies["lower"]
    assert lower.words == f"{100 * lower.amount:.3g} cm lower"
    assert lower.to_json()["unit"] == "m"
    assert remedies["tilt"].to_json()["amount"] == pytest.approx(
        np.degrees(remedies["tilt"].amount)
    )


def test_nothing_is_missing_for_a_goal_that_is_reached(scored, remedies):
    assert what_is_missing(scored(remedies["lower"].amount), 0) == ()
