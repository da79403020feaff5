"""Plans in files: read back, re-checked with Drake, and refused where they are false."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.errors import StoreFormatError, StoreMismatchError
from tcs.kernel.motion.straight import OFF_LINE
from tcs.model.tasks import TOOL_SPEED
from tcs.motion import Stop, Timed, check_plan, load_plan, save_plan
from tcs.motion.plan_check import LIMIT_BAR, _jumps
from tcs.motion.recheck import _is_within_limits
from tcs.output.terminal.set_tables import report_plan_check
from tcs.placement.scoring.rebuild import rebuild_scenes


@pytest.fixture(scope="module")
def written(planned, tmp_path_factory):
    """Path of the plan as JSON."""
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    save_plan(path, planned)
    return path


@pytest.fixture(scope="module")
def stop(two_goals):
    job, scene, _ = rebuild_scenes(tcs.load(two_goals))[0]
    return Stop.of(job, scene, 0, seed=0)


@pytest.fixture
def changed(written, tmp_path):
    """Function that writes the plan after a change of its JSON, and returns the path."""

    def write(change):
        plain = json.loads(written.read_text())
        change(plain)
        path = tmp_path / "changed.json"
        path.write_text(json.dumps(plain))
        return path

    return write


def verify(path):
    ran = CliRunner().invoke(app, ["verify", str(path), "--json"])
    assert ran.exception is None or isinstance(ran.exception, SystemExit)
    return ran


def test_the_plan_is_read_back_as_it_was(planned, written):
    assert load_plan(written).to_json() == json.loads(written.read_text())


def test_a_plan_holds(written, capsys):
    ran = verify(written)
    found = json.loads(ran.stdout)
    assert ran.exit_code == 0
    assert (found["false"], found["jumps"], found["goals"]) == (0, 0, 1)
    assert found["edges"] > 50
    assert found["max_position_error"] < 1e-6
    assert 0.9 < max(found["velocity"], found["acceleration"]) <= LIMIT_BAR
    assert 0.09 < found["tool_speed"] <= TOOL_SPEED
    assert found["max_line_error"] <= OFF_LINE
    report_plan_check(found)
    assert "the plan holds" in capsys.readouterr().out


def test_a_false_plan_is_found(changed):
    def through_the_person(plain):
        _, approach, retreat, _ = plain["stops"][0]["segments"]
        q = np.array(approach["positions"])
        approach["positions"] = (q + 3.0 * (q[-1] - q[0])).tolist()
        approach["times"] = (0.5 * np.array(approach["times"])).tolist()
        plain["stops"][0]["segments"] = [approach, retreat]

    ran = verify(changed(through_the_person))
    found = json.loads(ran.stdout)
    assert ran.exit_code == 1
    assert found["false"] > 0
    # From rest, between the two, and to rest.
    assert found["jumps"] == 3
    assert found["max_position_error"] > 0.1
    assert "do not use it" in ran.stderr


@pytest.mark.parametrize(
    ("key", "most", "change"),
    [
        # Cubics that overshoot between samples, whose velocities are within the limits.
        ("acceleration", LIMIT_BAR, lambda s: s["velocities"][3].__setitem__(0, 0.9)),
        ("tool_speed", LIMIT_BAR * TOOL_SPEED, lambda s: s.update(_faster(s))),
        ("max_line_error", OFF_LINE, lambda s: s["positions"][3].__setitem__(1, _beside(s))),
    ],
)
def test_a_plan_that_breaks_one_promise_between_samples_is_false(key, most, change, changed):
    def alone(plain):
        segment = plain["stops"][0]["segments"][1]
        plain["stops"][0] |= {"segments": [segment], "returns": False}
        change(segment)

    found = check_plan(load_plan(changed(alone)))
    assert found.to_json()[key] > most
    assert not found.is_sound


def _faster(segment):
    """Return a segment that takes 2 % less time at the same speeds."""
    return {"times": (0.98 * np.array(segment["times"])).tolist()}


def _beside(segment):
    return segment["positions"][3][1] + 0.002


def test_a_plan_a_full_turn_away_from_rest_has_jumps(changed, written, stop):
    def turned(plain):
        for segment in plain["stops"][0]["segments"]:
            q = np.array(segment["positions"])
            q[:, 4] += 2.0 * np.pi
            segment["positions"] = q.tolist()

    # It neither begins at rest nor returns there.
    assert _jumps(load_plan(changed(turned)).stops[0], stop) == 2
    moving = changed(
        lambda plain: plain["stops"][0]["segments"][1]["velocities"][-1].__setitem__(0, 0.01)
    )
    assert _jumps(load_plan(moving).stops[0], stop) == 1
    assert _jumps(load_plan(written).stops[0], stop) == 0


def test_a_plan_beyond_a_joint_limit_between_samples_is_false(written, stop):
    segment = load_plan(written).stops[0].segments[0]
    limit = float(stop.scene.arm_limits[1][1])
    q = np.tile(stop.rest, (2, 1))
    q[:, 1], v = limit - 1e-4, np.zeros((2, 7))
    v[:, 1] = 0.4, -0.4
    over = replace(segment, timing=Timed(np.array([0.0, 0.01]), q, v)).curve
    assert not _is_within_limits(stop.scene, over, 0)
    assert _is_within_limits(stop.scene, replace(over, dq=0.1 * v), 0)


def test_a_plan_for_other_models_is_refused(changed):
    path = changed(lambda plain: plain["made_from"].update(scene_digest="0" * 64))
    with pytest.raises(StoreMismatchError, match="Plan again"):
        check_plan(load_plan(path))


@pytest.mark.parametrize(
    "change",
    [
        lambda plain: plain.pop("joints"),
        lambda plain: plain.update(joints=["a"]),
        lambda plain: plain.update(stops=3),
        lambda plain: plain["stops"][0].update(base_x=float("nan")),
        lambda plain: plain["stops"][0]["segments"][0].update(type="jump"),
        lambda plain: plain["stops"][0]["segments"][0].update(times=[0.0, 0.0]),
        lambda plain: plain["stops"][0]["segments"][0]["positions"].pop(),
        lambda plain: plain["stops"][0]["segments"][0]["velocities"][1].__setitem__(0, 1e300),
        lambda plain: plain["stops"][0]["segments"][0]["times"].__setitem__(1, 1e-300),
        lambda plain: plain["stops"][0]["segments"][1].update(to=float("inf")),
        lambda plain: plain["stops"][0]["segments"][1].update(to=0.5),
        lambda plain: plain.update(seed="0"),
        lambda plain: plain.update(interpolation="linear"),
        # Larger than a floating-point number.
        lambda plain: plain["stops"][0]["segments"][0]["times"].__setitem__(1, 10**400),
        lambda plain: plain["stops"][0].update(base_x=10**400),
    ],
)
def test_damaged_plans_are_one_line(changed, change):
    with pytest.raises(StoreFormatError, match="is not a plan of tcs") as found:
        load_plan(changed(change))
    assert len(str(found.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda plain: plain["stops"][0]["segments"][1].update(to=7), "names goal 7"),
        (lambda plain: plain["stops"][0].update(bed_height=0.1), "other axes"),
        (lambda plain: plain.update(joints=list("abcdefg")), "other joints"),
    ],
)
def test_plans_that_do_not_fit_their_scene_are_refused(changed, change, message):
    with pytest.raises(StoreFormatError, match=message):
        check_plan(load_plan(changed(change)))
