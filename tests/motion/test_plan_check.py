"""Plans in files: read back, re-checked with Drake, and refused where they are false."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from tcs.cli.app import app
from tcs.errors import StoreFormatError, StoreMismatchError
from tcs.motion import check_plan, load_plan, save_plan
from tcs.output.terminal.motion_tables import report_plan_check


@pytest.fixture(scope="module")
def written(planned, tmp_path_factory):
    """Path of the plan as JSON."""
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    save_plan(path, planned)
    return path


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
    plain, again = json.loads(written.read_text()), load_plan(written).to_json()
    for one in (plain, again):
        del one["stops"][0]["duration"]
        for segment in one["stops"][0]["segments"]:
            # A file holds rounded samples in place of the certified curves.
            del segment["edges"], segment["duration"]
    assert again == plain


def test_a_plan_holds(written, capsys):
    ran = verify(written)
    found = json.loads(ran.stdout)
    assert ran.exit_code == 0
    assert (found["false"], found["jumps"], found["goals"]) == (0, 0, 1)
    assert found["edges"] > 50
    assert found["max_position_error"] < 1e-6
    assert 0.3 < max(found["velocity"], found["acceleration"]) < 1.001
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
    assert found["jumps"] == 2
    assert found["max_position_error"] > 0.1
    assert "do not use it" in ran.stderr


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
