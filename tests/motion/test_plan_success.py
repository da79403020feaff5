"""Plans under error: motions stay free without errors, and do not where the person meets them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tcs.cli.app import app
from tcs.errors import TcsError
from tcs.model.scene import ErrorDistribution
from tcs.motion import evaluate_plan, save_plan
from tcs.motion.plan_success import _Place, _PlanTried
from tcs.output.terminal.set_tables import report_plan_success
from tcs.placement.robustness import PerturbedPoints
from tcs.placement.store import PAPER


def off(joint, std):
    return {joint: ErrorDistribution(distribution="normal", std=std)}


def test_motions_stay_free_where_nothing_moves_and_not_where_the_person_does(planned):
    nothing = evaluate_plan(planned, samples=2, errors=off("person_y", 1e-9), replan=False)
    assert nothing.blind.tolist() == [[True], [True]]
    assert nothing.replanned is nothing.to_json()["replanned"] is None
    # The tool ends some centimetres off the face: half a metre leaves no sample as it was.
    far = evaluate_plan(planned, samples=12, errors=off("person_y", 0.5), replan=False)
    found = far.to_json()
    assert 0.0 <= found["blind"]["mean"] < 1.0
    assert found["blind"]["ci95"][0] <= found["blind"]["mean"] <= found["blind"]["ci95"][1]
    assert found["blind"]["per_stop"] == [found["blind"]["mean"]]


def test_a_goal_that_is_lost_at_its_stop_is_tried_from_the_others(planned):
    (stop,) = planned.stops
    far = replace(stop, at=replace(stop.at, base_x=stop.at.base_x + 3.0))
    both = replace(planned, stops=(far, stop))
    found = evaluate_plan(both, samples=1, errors=off("person_y", 1e-9))
    assert found.replanned.tolist() == [[True, True]]
    alone = evaluate_plan(replace(planned, stops=(far,)), samples=1, errors=off("person_y", 1e-9))
    assert alone.replanned.tolist() == [[False]]


@pytest.mark.parametrize("is_paper", [False, True], ids=["all", "paper"])
def test_the_base_may_touch_the_furniture_in_the_paper_alone(planned, is_paper):
    plan = replace(planned, made_from={**planned.made_from, PAPER: is_paper})
    tried = _PlanTried.of(plan, None)
    # The wheelchair comes nearer to the robot, until its wheel meets the base.
    nearer = {"wheelchair_y": np.arange(0.0, -0.75, -0.15)}
    place = _Place.of(plan.stops[0], PerturbedPoints(tried, nearer, 1))
    met = set()
    for room in range(len(nearer["wheelchair_y"])):
        place.stop_in(room)
        found = {pair[:2] for pair in place.hand.scene.violations()}
        met |= found
        assert set(place.resting_contacts()) == {
            pair
            for pair in found
            if not is_paper or pair[0] != "base_link" or pair[1].startswith("person::")
        }
    assert any(pair in place.uncounted for pair in met) == is_paper
    assert any(pair not in place.uncounted for pair in met)


@pytest.mark.slow
def test_the_command_prints_both_fractions(planned, tmp_path, capsys):
    save_plan(tmp_path / "plan.json", planned)
    command = ["evaluate", str(tmp_path / "plan.json"), "--samples", "3", "--json"]
    ran = CliRunner().invoke(app, command)
    assert ran.exit_code == 0, ran.output
    found = json.loads(ran.stdout)
    assert found["samples"] == 3
    for key in ("blind", "replanned"):
        assert 0.0 <= found[key]["mean"] <= 1.0
    assert set(found["errors"]) >= {"person_x", "person_y"}
    again = CliRunner().invoke(app, command)
    assert json.loads(again.stdout) | {"seconds": 0} == found | {"seconds": 0}
    report_plan_success(found)
    assert "of 3 samples" in capsys.readouterr().out


def test_options_of_sets_and_plans_without_motions_are_refused(planned):
    ran = CliRunner().invoke(app, ["evaluate", "plan.json", "--select", "single"])
    assert (ran.exit_code, "of a plan, only" in ran.stderr) == (2, True)
    with pytest.raises(TcsError, match="samples"):
        evaluate_plan(planned, samples=0)
