"""Environment files: their content, and the errors of invalid ones."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from tcs.errors import EnvironmentFileError, GridError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.grid import Axis, Grid
from tcs.model.scene import Scene, SceneSpec, load_environment

MINIMAL = {
    "name": "own",
    "title": "An environment",
    "origin": "in the corner",
    "source": "made up",
    "grid": {
        "base_x": {"unit": "m", "start": 0.0, "step": 0.1, "count": 2},
        "base_y": {"unit": "m", "start": 0.0, "step": 0.1, "count": 2},
        "base_yaw": {"unit": "deg", "start": 0.0, "step": 90.0, "count": 4},
        "torso": {"unit": "m", "start": 0.0, "step": 0.1, "count": 2},
    },
}
SHIFT = {"unit": "m", "start": -0.1, "step": 0.05, "count": 5}
FOLLOWED_BY_B = {"knots": [0, 1], "joints": {"b": [0, 1]}}


def written(tmp_path: Path, **changes: object) -> Path:
    path = tmp_path / "own.yaml"
    path.write_text(yaml.safe_dump({**MINIMAL, **changes}, sort_keys=False), encoding="utf-8")
    return path


def test_wheelchair_has_the_grid_and_the_errors_of_the_paper():
    environment = load_environment("wheelchair")
    grid = Grid.from_spec(environment.grid)
    assert grid.shape == (61, 61, 8, 3)
    assert grid.size == 89304
    assert grid.axis("base_x").values[[0, -1]].tolist() == [-1.5, 1.5]
    # TCS Table II.
    deviations = {name: e.standard_deviation for name, e in environment.errors.items()}
    assert deviations == {
        "wheelchair_x": 0.0125,
        "wheelchair_y": 0.0125,
        "wheelchair_yaw": np.radians(2.5),
        "person_x": 0.05,
        "person_y": 0.05,
        "person_yaw": np.radians(5.0),
        "head_tilt": np.radians(5.0),
    }


def test_an_environment_is_a_value():
    environment = load_environment("wheelchair")
    again = pickle.loads(pickle.dumps(environment))
    assert again == environment
    assert hash(again) == hash(environment)
    assert hash(environment.model_copy(update={"contact_margin": 0.002})) != hash(environment)
    with pytest.raises(ValueError, match="frozen"):
        environment.name = "other"


def test_files_are_found_beside_the_environment_first_then_in_the_data_folder(tmp_path):
    (tmp_path / "shelf.sdf").write_text("<sdf version='1.9'/>")
    models = [
        {"name": "wheelchair", "file": "wheelchair.sdf"},
        {"name": "shelf", "file": "shelf.sdf"},
    ]
    environment = load_environment(written(tmp_path, models=models))
    shipped = data_folder() / "models" / "beds_wheelchairs" / "wheelchair.sdf"
    assert Path(environment.models[0].file) == shipped.resolve()
    assert Path(environment.models[1].file) == (tmp_path / "shelf.sdf").resolve()


def test_unknown_name_gets_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'wheelchair'"):
        load_environment("wheelchir")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"flor": True}, r"unknown key 'flor'\. Known: .*based_on.*Did you mean 'floor'"),
        (
            {"models": [{"name": "a", "fil": "b"}]},
            r"field 'models\[0\]': unknown key 'fil'\. Known: file, .*'file'\?",
        ),
        (
            {"obstacles": [{"name": "a", "box": [1, 1, 1], "size": 1}]},
            r"field 'obstacles\[0\]': unknown key 'size'\. Known: box, capsule, ",
        ),
        ({"obstacles": [{"name": "a"}]}, r"obstacles\[0\]'.*give one of box.*not none"),
        (
            {"obstacles": [{"name": "a", "box": [1, 1, 1], "file": "x.sdf"}]},
            r"obstacles\[0\]'.*not box and file",
        ),
        (
            {"obstacles": [{"name": "a", "box": [1, 0, 1]}]},
            r"obstacles\[0\]\.box\[1\]' is 0 m, but a size must be 1e-06 to 100 m",
        ),
        (
            {"obstacles": [{"name": "a", "box": [1, 1, 1]}] * 2},
            r"name 'a' is used twice",
        ),
        ({"obstacles": [{"name": "floor", "box": [1, 1, 1]}]}, r"'floor' is used twice or reserv"),
        ({"person": "anna"}, "person: no model is named 'anna'; there are none"),
        ({"models": [{"name": "a", "file": "nowhere.sdf"}]}, r"models\[0\]\.file.*nowhere\.sdf"),
        ({"padding": {"a::b": -0.1}}, r"padding\.a::b.*a clearance must be 0 to 1 m"),
        ({"contact_margin": float("nan")}, r"contact_margin"),
        ({"joints": {"a": True}}, r"field 'joints\.a' is True, but must be a valid number"),
        ({"title": 5, "name": 5}, r"field 'name' is 5, .* \(1 more after this one\.\)"),
        ({"errors": {"j": {"distribution": "normal"}}}, r"errors\.j'.*either 'std'"),
        ({"errors": {"j": {"distribution": "flat", "std": 1}}}, r"errors\.j\.distribution.*normal"),
        ({"observed": {"person_y": 0.1}}, r"field 'observed\.person_y' is 0\.1, but must be"),
        ({"posture": {"a": {"knots": [0, 1]}}}, r"posture\.a\.joints' is missing"),
        ({"posture": {"a": {"knots": [0, 1], "joints": {}}}}, r"posture\.a\.joints'.* at least 1"),
        ({"posture": {"a": {"joints": {"b": [0, 1]}}}}, r"posture\.a': give either 'knots'"),
        (
            {"posture": {"a": {"knots": [0, 1], "knots_deg": [0, 1], "joints": {"b": [0, 1]}}}},
            r"posture\.a': give either 'knots'",
        ),
        (
            {"posture": {"a": {"knots": [0], "joints": {"b": [0]}}}},
            r"posture\.a\.knots'.*at least 2",
        ),
        (
            {"posture": {"a": {"knots": [1, 1], "joints": {"b": [0, 1]}}}},
            r"posture\.a': every knot must be greater",
        ),
        (
            {"posture": {"a": {"knots": [0, 1, 2], "joints": {"b": [0, 1]}}}},
            r"posture\.a': joint 'b' has 2 positions, but there are 3 knots",
        ),
        (
            {"posture": {"a": FOLLOWED_BY_B, "b": {"knots": [0, 1], "joints": {"c": [0, 1]}}}},
            r"posture: 'b' follows 'a' and leads others",
        ),
        (
            {"posture": {"a": FOLLOWED_BY_B, "c": FOLLOWED_BY_B}},
            r"posture: 'b' follows 'a' and 'c'; it can follow one",
        ),
        ({"posture": {"a": FOLLOWED_BY_B}, "joints": {"b": 1}}, r"joints: 'b' follows 'a'"),
        (
            {
                "posture": {"a": FOLLOWED_BY_B},
                "errors": {"b": {"distribution": "normal", "std": 1}},
            },
            r"errors: 'b' follows 'a', so it cannot be set itself",
        ),
        (
            {"posture": {"a": FOLLOWED_BY_B}, "observed": {"b": SHIFT}},
            r"observed: 'b' follows 'a'",
        ),
    ],
    ids=lambda value: str(value)[:40] if isinstance(value, dict) else "",
)
def test_a_bad_file_is_refused_in_one_line_that_names_file_and_field(tmp_path, changes, expected):
    path = written(tmp_path, **changes)
    with pytest.raises((EnvironmentFileError, UnknownNameError), match=expected) as caught:
        load_environment(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bad_grid_names_the_file(tmp_path):
    grid = {**MINIMAL["grid"], "torso": {"unit": "m", "start": 0.0, "step": 0.1, "count": 0}}
    with pytest.raises(GridError, match=r"own\.yaml', field 'grid'.*torso.*empty"):
        load_environment(written(tmp_path, grid=grid))


@pytest.mark.parametrize(
    ("axes", "error", "expected"),
    [
        ({"person_y": {**SHIFT, "count": 0}}, GridError, "axis 'person_y': count is 0"),
        ({"person_y": {**SHIFT, "unit": "cm"}}, GridError, "axis 'person_y': unit is 'cm'"),
        ({"person_y": {"unit": "m"}}, GridError, "axis 'person_y' needs start, step, count"),
        ({"person_y": {**SHIFT, "stop": 1}}, UnknownNameError, "axis 'person_y': unknown key"),
        ({"torso": SHIFT}, GridError, "axis 'torso' is also in 'grid'.*'observed'"),
    ],
    ids=["empty", "unit", "missing", "key", "both"],
)
def test_a_bad_observed_axis_names_the_file(tmp_path, axes, error, expected):
    with pytest.raises(error, match=rf"own\.yaml', field 'observed': {expected}"):
        load_environment(written(tmp_path, observed=axes))


def test_observed_axes_are_axes_in_the_order_of_the_file(tmp_path):
    turn = {"unit": "deg", "start": -5, "step": 5, "count": 3}
    environment = load_environment(written(tmp_path, observed={"turn": turn, "shift": SHIFT}))
    assert environment.observed_axes == (
        Axis("turn", "deg", -5, 5, 3),
        Axis("shift", "m", -0.1, 0.05, 5),
    )
    assert load_environment(written(tmp_path)).observed_axes == ()


def test_posture_and_observed_are_inherited_from_the_base(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text("{name: own, based_on: bed}")
    ours, bed = load_environment(own), load_environment("bed")
    assert ours.posture == bed.posture
    assert ours.observed_axes == bed.observed_axes
    own.write_text("{name: own, based_on: bed, observed: {}}")
    assert load_environment(own).observed_axes == ()


@pytest.mark.parametrize("text", ["[1, 2]", "a: [", "\x00"], ids=["list", "torn", "binary"])
def test_a_file_that_is_not_a_mapping_is_refused(tmp_path, text):
    path = tmp_path / "own.yaml"
    path.write_text(text)
    with pytest.raises(EnvironmentFileError, match=r"own\.yaml"):
        load_environment(path)


def test_a_key_that_comes_twice_is_refused(tmp_path):
    path = written(tmp_path)
    path.write_text(path.read_text() + "title: another\n")
    with pytest.raises(EnvironmentFileError, match=r"line .*: key 'title' appears twice"):
        load_environment(path)


def test_a_fault_of_the_grid_names_the_field_once(tmp_path):
    axis = {"unit": "m", "start": 0.0, "step": 0.1, "count": 1}
    path = written(tmp_path, grid={"base_x": axis})
    with pytest.raises(GridError, match=r"own\.yaml', field 'grid': needs axis base_y"):
        load_environment(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(EnvironmentFileError, match="cannot be read"):
        load_environment(tmp_path / "none.yaml")


def test_a_file_needs_only_what_differs_from_its_base(tmp_path):
    own = tmp_path / "own.yaml"
    own.write_text("{name: own, title: t, based_on: wheelchair, contact_margin: 0.004}")
    corner = tmp_path / "corner.yaml"
    corner.write_text("{name: corner, based_on: own.yaml, obstacles: [{name: a, box: [1, 1, 1]}]}")
    environment, base = load_environment(corner), load_environment("wheelchair")
    assert (environment.name, environment.title) == ("corner", "t")
    assert environment.contact_margin == 0.004
    assert [obstacle.name for obstacle in environment.obstacles] == ["a"]
    changed = {"name", "title", "contact_margin", "obstacles"}
    assert environment.model_dump(exclude=changed) == base.model_dump(exclude=changed)


def test_an_invalid_base_is_refused(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("{name: own, based_on: wheelchir}")
    with pytest.raises(UnknownNameError, match=r"own\.yaml', field 'based_on'.*'wheelchair'"):
        load_environment(path)
    path.write_text("{name: own, based_on: other.yaml}")
    (tmp_path / "other.yaml").write_text("{name: other, based_on: ./own.yaml}")
    with pytest.raises(EnvironmentFileError, match=r"other\.yaml', field 'based_on'.*in turn"):
        load_environment(path)


def test_the_example_of_the_documentation_works(tmp_path, pr2):
    text = (Path(__file__).parents[3] / "docs" / "scene.md").read_text(encoding="utf-8")
    blocks = dict(re.findall(r"```(yaml|xml)\n(.*?)```", text, flags=re.DOTALL))
    (tmp_path / "dining.yaml").write_text(blocks["yaml"], encoding="utf-8")
    (tmp_path / "lamp.sdf").write_text(blocks["xml"], encoding="utf-8")
    scene = Scene(SceneSpec(pr2, load_environment(tmp_path / "dining.yaml")))
    names = [part.name for part in scene.built.parts]
    assert {"table", "lamp::pole", "lamp::shade", "person::head_center"} <= set(names)
    lamp = scene.built.parts[names.index("lamp::shade")]
    p_WG = scene.shape_pose(lamp).translation()
    np.testing.assert_allclose(p_WG, [0.2, 0.9, 1.45], atol=1e-12)
    scene.place_base(1.3, 0.9, 0.0)
    assert any(b == "table" for _, b, _ in scene.violations())
