import doctest
import importlib
import inspect

import pytest

import tcs
from tests.fresh import fresh
from tests.placement.store.example import score_file

PROMISED = [
    "Choice",
    "Constraints",
    "Evaluation",
    "Explanation",
    "InitialConfiguration",
    "BlockFolder",
    "LiveScorer",
    "MotionPlan",
    "Observation",
    "Obstacle",
    "Placement",
    "Population",
    "Region",
    "ScoreFile",
    "TcsError",
    "Top",
    "TravelWeights",
    "UtilityWeights",
    "Verification",
    "__version__",
    "evaluate",
    "examine",
    "explain",
    "load",
    "place",
    "plan",
    "population",
    "refine",
    "robustify",
    "save",
    "score",
    "score_observed",
    "select",
    "summary",
    "verify",
]


def test_promise():
    assert sorted(tcs.__all__) == sorted(PROMISED)
    assert set(PROMISED) <= set(dir(tcs))


@pytest.mark.parametrize("name", PROMISED)
def test_promised_name_is_there(name):
    assert getattr(tcs, name)


def test_unknown_name():
    with pytest.raises(AttributeError, match="no attribute 'scor'"):
        _ = tcs.scor


@pytest.mark.parametrize(
    ("name", "package", "there"),
    [("load", "tcs.placement.store", "load_scores"), ("score", "tcs.placement.scoring", "score")],
)
def test_names_are_those_of_the_packages(name, package, there):
    assert getattr(tcs, name) is getattr(importlib.import_module(package), there)


def test_import_loads_nothing_heavy():
    heavy = "('numpy', 'joblib', 'pydrake', 'numba', 'matplotlib', 'pydantic', 'yaml', 'typer')"
    code = f"import sys, tcs; print([m for m in {heavy} if m in sys.modules])"
    assert fresh(code) == "[]"


def test_choosing_loads_neither_simulator_nor_compiler(tmp_path):
    path = tmp_path / "small.tcs"
    tcs.save(path, score_file())
    code = (
        "import sys, tcs\n"
        f"file = tcs.load({str(path)!r})\n"
        "here = tcs.InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)\n"
        "choice = tcs.select(file, here, weights=tcs.UtilityWeights(travel=0.2))\n"
        "assert len(choice.members) in (1, 2)\n"
        "constraints = tcs.Constraints(only=('base_x <= 0',), prefer=('base_y >= 0.3',),\n"
        "    forbid=(tcs.Region(((5, 5), (6, 5), (6, 6))),))\n"
        "tcs.select(file, here, constraints=constraints, top=tcs.Top(count=2))\n"
        "print([m for m in ('pydrake', 'numba', 'matplotlib') if m in sys.modules])"
    )
    assert fresh(code) == "[]"


def test_select_is_a_plain_function_with_a_signature():
    assert inspect.isfunction(tcs.select)
    assert next(iter(inspect.signature(tcs.select).parameters)) == "scores"


def test_docstring_runs():
    assert doctest.testmod(tcs).failed == 0
