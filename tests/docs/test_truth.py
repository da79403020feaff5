"""Keys, names and defaults that the docs list are those of the code."""

import json
import re
from pathlib import Path

import pytest

import tcs
from tcs.kernel.dexterity import MEASURES
from tcs.model.grid import Grid
from tcs.model.robots import load_robot, robot_names
from tcs.model.scene.environment.environment_file import SHAPES
from tcs.model.scene.environment.model_files import CLOUDS, MESHES, SUFFIXES
from tcs.output.report import CheckSizes, make_score_page, make_score_report
from tcs.output.words import explanation_in_words
from tcs.output.words.reasons import COLOUR_NAMES
from tcs.placement.reasons import explain, fix_weights
from tcs.placement.selection import TravelWeights, UtilityWeights
from tcs.placement.store.encoding import encode
from tcs.placement.tables import Reason
from tests.placement.store.example import score_file
from tests.placement.store.test_success import with_estimates

DOCS = Path(__file__).resolve().parents[2] / "docs"
FIGURES = DOCS.parent / "benchmarks" / "figures"


def page(name: str) -> str:
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def rows(text: str, first: str) -> list[list[str]]:
    """Return the cells of the table whose first line begins so, title and rule left out."""
    lines = text[text.index(first) :].splitlines()
    body = lines[2:]
    end = next((i for i, line in enumerate(body) if not line.startswith("|")), len(body))
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in body[:end]]


def names(cells: list[list[str]]) -> list[str]:
    return [name for row in cells for name in re.findall(r"`([\w-]+)`", row[0])]


@pytest.mark.parametrize("part", ["sets", "scores", "success"])
def test_parts_of_a_score_file(part):
    listed = names(rows(page("files"), f"| `{part}` | type"))
    assert sorted(listed) == sorted(encode(with_estimates())["tables"][0][part])


def test_top_level_of_a_score_file():
    text = page("files")
    text = text[text.index("Top level:") : text.index("`success` is None")]
    for key in encode(score_file()):
        assert f"`{key}`" in text, key


def test_json_of_an_explanation():
    cells, file = rows(page("explaining"), "| key | value |"), score_file()
    found = explanation_in_words(file, explain(file, 0))
    # The command adds what is missing where nothing reaches the goal.
    assert sorted(names(cells)) == sorted([*found, "missing"])
    for key in ("explained", "nearest_reaching"):
        (text,) = (cell for name, cell in cells if name == f"`{key}`")
        unknown = [inner for inner in found[key] if f"`{inner}`" not in text]
        assert not unknown, f"docs/explaining.md, JSON, lacks {unknown} of `{key}`"


def test_costs_of_changes():
    weights = fix_weights(Grid.from_dict(score_file().grid))
    cells = rows(page("explaining"), "| change | cost | why |")
    costs = {change: float(cost) for change, cost, _ in cells}
    assert costs["driving, per metre"] == weights.metre
    assert costs["turning, per radian"] == weights.turn
    assert costs["torso height, per metre"] == weights.torso


def test_default_weights():
    text = page("selection")
    listed = {row[0]: row for row in rows(text, "| symbol | meaning | default |")}
    weights = UtilityWeights()
    for symbol, value in [
        ("alpha", weights.reachability),
        ("beta", weights.manipulability),
        ("gamma", weights.travel),
        ("delta", weights.success),
    ]:
        assert float(listed[symbol][2]) == value
    travel = TravelWeights()
    for row in rows(text, "| motion | weight | default |"):
        field = re.fullmatch(r"`TravelWeights\.(\w+)`", row[1])[1]
        assert float(row[2]) == (getattr(travel, field) or 0.0)


def test_measures():
    assert names(rows(page("method"), "| name | value | function |")) == list(MEASURES)


def test_types_of_obstacle_files():
    listed = {row[0] for row in rows(page("scene"), "| key | what it is | shapes")}
    files = {cell: set(re.findall(r"\.[a-z]+\b", cell)) for cell in listed if "file:" in cell}
    known = {frozenset(SUFFIXES), frozenset(MESHES), frozenset(CLOUDS)}
    assert {frozenset(endings) for endings in files.values()} == known
    shapes = {match[1] for cell in listed if (match := re.match(r"`(\w+):", cell))}
    assert shapes == set(SHAPES)


def test_reasons():
    # The page lists them in the order of the checks.
    listed = names(rows(page("method"), "| reason | meaning |"))
    assert sorted(listed) == sorted(reason.name.lower() for reason in Reason)


def test_colours_of_verdicts():
    listed = [row[0] for row in rows(page("viewer"), "| colour | goal |")]
    assert listed == [COLOUR_NAMES[reason] for reason in Reason]


@pytest.mark.slow
def test_parts_of_a_report(tmp_path):
    # An environment with states has a report with every part.
    path = tmp_path / "bed.tcs"
    tcs.save(
        path,
        tcs.score("scratching_chest", DOCS.parent / "examples" / "small_bed.yaml", paper=True),
    )
    report = make_score_page(
        make_score_report(path, sizes=CheckSizes(pairs=1, dense=0)), command="tcs report"
    )
    listed = [row[0] for row in rows(page("reading-a-report"), "| part of the page |")]
    for section in report.sections:
        assert any(part.startswith(section.title) for part in listed), section.title


def test_the_shapes_of_every_robot_are_measured():
    expected = set()
    for name in robot_names():
        robot = load_robot(name)
        joints = [robot.model().joints[joint] for joint in robot.arm_joints]
        both = any(joint.soft != joint.hard for joint in joints)
        expected |= {f"{name}, soft limits", f"{name}, hard limits"} if both else {name}
    saved = json.loads((FIGURES / "shapes.json").read_text(encoding="utf-8"))
    assert {line for line, *_ in saved["tables"]["blocked"]["rows"]} == expected
    assert {cells[0] for cells in rows(page("robots"), "|  | free of self-collision |")} == expected
