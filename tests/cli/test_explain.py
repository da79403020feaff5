import dataclasses
import re

import pytest

import tcs
from tcs.output.words import explanation_in_words, pair_text
from tcs.placement.reasons import fix_weights
from tcs.placement.tables import Reason
from tests.placement.store.example import SHIFT, score_file
from tests.placement.tables.small import small_grid

GRID = small_grid(nx=4, ny=3, yaws=4, torsos=2, bed=2, head=2)
AT = ("--at", "bed_height=0.03", "--at", "head_rest_deg=30")
HERE = ("--here", -0.45, 0.3, 100, "--torso", 0.1, *AT)


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "scores.tcs"
    tcs.save(path, score_file(grid=GRID, share=0.05))
    return path


def test_json_is_what_python_returns(tcs_command, stored):
    ran = tcs_command("explain", stored, "--goal", 3, "--configuration", 17, "--json")
    assert (ran.code, ran.err) == (0, "")
    file = tcs.load(stored)
    expected = explanation_in_words(file, tcs.explain(file, 2, 17))
    assert ran.json == expected
    assert {"reasons", "blocking_pairs", "nearest_reaching"} <= set(ran.json)
    assert {"members", "changes"} <= set(ran.json["nearest_reaching"])
    assert sum(ran.json["reasons"].values()) == GRID.size


def test_a_goal_is_named_as_it_is_printed(tcs_command, stored, tmp_path):
    path = tmp_path / "named.tcs"
    file = score_file(grid=GRID, share=0.05)
    names = ("chin", "cheek", "cheek", "left ear", "4")
    goals = [{"name": name, "body_frame": "head"} for name in names]
    tcs.save(path, dataclasses.replace(file, task={**file.task, "goals": goals}))
    for given in ("left ear", "4", "left ear (4)"):
        ran = tcs_command("explain", path, "--goal", given)
        assert ran.out.startswith("Goal left ear (4) of shaving")
    assert tcs_command("explain", path, "--goal", "left ear", "--json").json["goal"] == 3
    ran = tcs_command("explain", path, "--goal", "cheek")
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert "2 goals of task 'shaving' are called 'cheek': cheek (2), cheek (3)." in ran.err


def test_options_reach_the_explanation(tcs_command, stored):
    words = (
        *("--metre-weight", 0.5, "--turn-weight", 2, "--torso-weight", 0.1),
        *("--axis-weight", "bed_height=7", "--travel", "straight"),
    )
    result = tcs_command("explain", stored, "--goal", 1, *HERE, *words, "--json").json
    assert result["weights"] == {
        "metre": 0.5,
        "turn": 2.0,
        "torso": 0.1,
        "environment": {"bed_height": 7.0, "head_rest": 1.0},
        "route": "straight",
    }
    assert result["explained"]["offset"] == {
        "base_x": 0.05,
        "base_yaw_deg": 10.0,
        "torso": -0.05,
        "bed_height": 0.03,
        "head_rest_deg": -5.0,
    }
    starts = {change["axis"]: change["from"] for change in result["nearest_reaching"]["changes"]}
    assert starts.get("torso", 0.1) == 0.1
    assert starts["head_rest_deg"] == 30.0


def test_default_weights_are_those_of_the_library(tcs_command, stored):
    weights_used = tcs_command("explain", stored, "--goal", 1, "--json").json["weights"]
    weights = fix_weights(GRID)
    assert weights_used.pop("environment") == dict(weights.environment)
    assert weights_used == {name: getattr(weights, name) for name in weights_used}


def test_observed_state(tcs_command, tmp_path):
    path = tmp_path / "shifts.tcs"
    tcs.save(path, score_file(tables=3, observed=[SHIFT], share=0.1))
    words = ("explain", path, "--goal", 2, "--observed", "person_y=0.04")
    result = tcs_command(*words, "--json").json
    assert (result["observed"], result["observed_error"]) == (
        {"person_y": 0.05},
        {"person_y": -0.01},
    )
    assert "person y 0.05 m; observed person y differs by -0.01 m" in tcs_command(*words).out
    ran = tcs_command("explain", path, "--goal", 2, "--observed", "person_y=0.2")
    assert ran.code == 1
    assert "person_y" in ran.err


def test_report(tcs_command, stored):
    file = tcs.load(stored)
    scores = file.nominal.scores
    # A configuration at which the arm is the reason.
    h = int((scores.reason[:, 2] == Reason.ARM_BLOCKED).argmax())
    out = tcs_command("explain", stored, "--goal", 3, "--configuration", h).out
    explained = tcs.explain(file, 2, h)
    assert explained.fix.sentence in " ".join(out.split())
    assert f"the best one: {pair_text(explained.explained.pair)}" in " ".join(out.split())
    for words in ("nearest reaching", "of those checked", "per metre of bed height"):
        assert words in " ".join(out.split())


def test_report_of_a_goal_that_is_reached(tcs_command, stored):
    file = tcs.load(stored)
    h = int(file.nominal.sets.candidates[0])
    goal = int(file.nominal.scores.reached[h].argmax())
    out = tcs_command("explain", stored, "--goal", goal + 1, "--configuration", h).out
    assert f"It is reached from configuration {h}" in out
    assert "nearest reaching" not in out


def test_report_of_a_goal_that_nothing_reaches(tcs_command, tmp_path):
    path = tmp_path / "none.tcs"
    tcs.save(path, score_file(grid=GRID, share=0.0))
    ran = tcs_command("explain", path, "--goal", 1)
    assert ran.code == 0
    assert re.search(
        r"No configuration of the grid reaches it\. [\d,]+ passed the most checks: ",
        " ".join(ran.out.split()),
    )
    assert tcs_command("explain", path, "--goal", 1, "--json").json["explained"] is None


def test_quick_and_light(process, stored):
    before = (
        "import atexit; atexit.register(lambda: print([m for m in ('pydrake', 'numba', "
        "'matplotlib', 'pandas', 'trimesh') if m in sys.modules], file=sys.stderr))"
    )
    ran = process("explain", stored, "--goal", 1, "--configuration", 3, before=before)
    assert ran.code == 0
    assert ran.err.strip() == "[]"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--goal", 6), "no goal 6: task 'shaving' has 5, numbered 1 to 5"),
        (("--goal", 0), "no goal 0"),
        (("--goal", "chim"), "task 'shaving': unknown goal 'chim'. Known: "),
        (("--goal", -1), "no goal -1"),
        (("--goal", 1, "--configuration", GRID.size), f"indices are 0 to {GRID.size - 1}"),
        (("--goal", 1, "--configuration", -1), "no configuration -1"),
        (("--goal", 1, "--here", 9, 0.3, 0, *AT), "base_x 9 m, beyond the grid"),
        (("--goal", 1, "--here", 0, 0.3, 0), "lacks bed_height, head_rest"),
        (("--goal", 1, *HERE, "--at", "bed_hight=0.1"), "Did you mean 'bed_height'"),
        (("--goal", 1, "--here", 0, 0.3, 0, "--at", "bed_height"), "must be NAME=NUMBER"),
        (("--goal", 1, "--here", 0, 0.3, 0, *AT[:2], "--at", "head_rest=1"), "must be in 'rad'"),
        (("--goal", 1, "--axis-weight", "legs=1"), "unknown environment axis 'legs'"),
        (("--goal", 1, "--turn-weight", -1), "Weight of travel per turn is -1"),
        (("--goal", 1, "--travel", "flying"), "unknown route 'flying'"),
        (("--goal", 1, "--observed", "person_y=0.1"), "unknown observed axis 'person_y'"),
    ],
)
def test_bad_input_is_one_line(tcs_command, stored, words, message):
    ran = tcs_command("explain", stored, *words)
    assert (ran.code, ran.out) == (1, "")
    assert message in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(("--arm", "left"), id="arm of all goals"),
        pytest.param(("--goal", 1, "--configuration", 1, *HERE), id="two places"),
        pytest.param(("--goal", 1, "--torso", 0.1), id="torso of nothing"),
        pytest.param(("--goal", 1, *AT), id="bed of nothing"),
    ],
)
def test_misuse(tcs_command, stored, words):
    ran = tcs_command("explain", stored, *words)
    assert (ran.code, ran.out) == (2, "")
