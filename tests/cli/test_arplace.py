"""The commands `tcs arplace`."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tcs.capability.arplace import load_arplace, load_probability_map, save_arplace
from tests.capability.arplace.example import discs, model

COARSE = (
    *("--distances", 0.0, 0.15, 3, "--heights", 0.5, 0.2, 2),
    *("--base-x", -1.0, 0.1, 11, "--base-y", -0.9, 0.1, 19),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A model learned on the command line, and the output."""
    from typer.testing import CliRunner

    from tcs.cli.app import app

    path = tmp_path_factory.mktemp("models") / "top.arp"
    words = ["arplace", "learn", "--robot", "tiago", "--out", path, *COARSE, "--json"]
    result = CliRunner().invoke(app, [*map(str, words)])
    assert result.exit_code == 0, result.output
    return path, json.loads(result.stdout)


@pytest.fixture
def holed(tmp_path):
    """A model of regions with a hole."""
    path = tmp_path / "hole.arp"
    save_arplace(path, model(discs(hole=0.15)))
    return path


def test_learn_writes_a_model_and_its_summary(made):
    path, result = made
    arplace = load_arplace(path)
    assert arplace.task.counts == (3, 2, 1)
    assert result["grasps"] == 6
    assert result["labels"] == arplace.reached.size
    assert result["reached"] == int(arplace.reached.sum()) > 100
    assert result["false_inclusions"] < 0.1 * result["reached"]
    assert result["representation"] == "by-shape"


def test_query_gives_best_success_and_seconds(made, tcs_command, tmp_path):
    words = ("arplace", "query", made[0], "--std", 0.05)
    picture, stored = tmp_path / "map.png", tmp_path / "map.apm"
    result = tcs_command(*words, "--out", stored, "--picture", picture, "--json").json
    assert result["best"].keys() == {"x", "y", "yaw_deg", "torso_height"}
    low, high = result["success_ci95"]
    assert 0.9 < low <= result["success"] <= high <= 1.0
    assert result["seconds"] > 0.0
    found = load_probability_map(stored)
    i = int(np.argmin(np.abs(found.x - result["best"]["x"])))
    j = int(np.argmin(np.abs(found.y - result["best"]["y"])))
    assert found.probability[i, j] == pytest.approx(result["success"], abs=0.06)
    assert picture.stat().st_size > 10_000
    text = tcs_command(*words).out
    assert f"best x {result['best']['x']:.3f} m" in text
    assert "95 % interval" in text


def test_a_point_estimate_has_no_spread(holed, tcs_command):
    result = tcs_command("arplace", "query", holed, "--json").json
    assert (result["success"], result["outside"]) == (1.0, 0.0)


def test_a_covariance_replaces_the_standard_deviation(made, tcs_command):
    one, other = (
        tcs_command("arplace", "query", made[0], *words, "--json").json
        for words in (("--std", 0.1), ("--covariance", 0.01, 0.0, 0.01))
    )
    assert one["success"] == other["success"]


def test_an_obstacle_moves_the_best_base_position(holed, tcs_command):
    free = tcs_command("arplace", "query", holed, "--json").json["best"]
    words = ("--obstacle", f"{free['x']},{free['y']},0.1,0.1,45", "--clearance", 0.1)
    other = tcs_command("arplace", "query", holed, *words, "--json").json["best"]
    assert np.hypot(other["x"] - free["x"], other["y"] - free["y"]) > 0.1


@pytest.mark.parametrize("rule", ["max", "product"])
def test_merge_of_two_objects(made, tcs_command, tmp_path, rule):
    paths = [tmp_path / "left.apm", tmp_path / "right.apm"]
    for path, y in zip(paths, (0.2, -0.2), strict=True):
        words = ("--std", 0.08, "--y", y, "--out", path)
        assert tcs_command("arplace", "query", made[0], *words).code == 0
    merged = tmp_path / "both.apm"
    result = tcs_command("arplace", "merge", *paths, "--rule", rule, "--out", merged, "--json").json
    values = np.array([load_probability_map(path).probability for path in paths])
    expected = values.max(axis=0) if rule == "max" else values.prod(axis=0)
    np.testing.assert_allclose(load_probability_map(merged).probability, expected)
    assert result["success"] == pytest.approx(expected.max())
    shown = tcs_command("arplace", "show", merged, "--out", tmp_path / "both.png", "--json").json
    assert shown["best"] == result["best"]


@pytest.mark.parametrize("figure", ["modes", "reconstruction", "generalisation"])
def test_show_draws_every_figure(made, holed, tcs_command, tmp_path, figure):
    for path in (made[0], holed):
        picture = tmp_path / "figure.png"
        ran = tcs_command("arplace", "show", path, "--figure", figure, "--out", picture)
        assert ran.code == 0, ran.err
        assert picture.stat().st_size > 10_000


def test_show_summarises_without_a_picture(holed, tcs_command):
    ran = tcs_command("arplace", "show", holed)
    assert "0 of 3 regions have a single boundary" in ran.out
    assert "signed-distance" in ran.out


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--distance", 3), 1, "distance 3 is outside the learned range"),
        (("--std-z", 0.1), 1, "error of z must be 0"),
        (("--std", -1), 1, "standard deviation of x"),
        (("--covariance", 1, 2, 1), 1, "positive semidefinite"),
        (("--obstacle", "1,2"), 1, "--obstacle is '1,2'"),
        (("--obstacle", "0,0,9,9"), 1, "from no base position"),
        (("--samples", 0), 1, "samples is 0"),
        (("--out", "no/folder/map.apm"), 1, "cannot be written"),
        (("--picture", "map.txt"), 1, "must end in"),
    ],
)
def test_bad_queries_are_one_line(holed, tcs_command, words, code, message):
    ran = tcs_command("arplace", "query", holed, *words)
    assert ran.code == code
    assert message in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--robot", "pr3"), "unknown robot 'pr3'"),
        (("--approach", "below"), "unknown approach 'below'"),
        (("--distances", 0, 0, 3), "step is 0"),
        (("--heights", 0.01, 0, 1), "below the floor"),
        (("--scale", 0), "scale of the support vector machine"),
        (("--representation", "splines"), "unknown representation"),
    ],
)
def test_bad_tasks_are_one_line(tcs_command, tmp_path, words, message):
    ran = tcs_command("arplace", "learn", "--out", tmp_path / "x.arp", *COARSE, *words)
    assert ran.code == 1
    assert message in ran.err
    assert ran.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_files_of_the_wrong_type_are_one_line(holed, tcs_command, tmp_path):
    stored = tmp_path / "map.apm"
    tcs_command("arplace", "query", holed, "--out", stored)
    for words in (("query", stored), ("merge", holed), ("show", tmp_path / "none.arp")):
        ran = tcs_command("arplace", *words)
        assert ran.code == 1
        assert ran.err.count("\n") == 1
    picture = tmp_path / "map.png"
    for words in (
        ("show", holed, "--out", picture, "--figure", "faces"),
        ("show", holed, "--figure", "modes"),
        ("show", stored, "--out", picture, "--figure", "modes"),
        ("query", holed, "--clearance", 0.1),
        ("query", holed, "--std", 0.1, "--covariance", 0.01, 0.0, 0.01),
    ):
        assert tcs_command("arplace", *words).code == 2, words
    assert not picture.exists()
