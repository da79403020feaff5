"""The report of one score file, of a real but small one."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import shlex

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import tcs
from tcs.cli.app import app
from tcs.model.grid import InitialConfiguration
from tcs.model.people import load_person
from tcs.output.report import CheckSizes, as_html, as_markdown, make_score_page, make_score_report
from tcs.output.report.score.reproduce import as_given, robustify_command, score_command
from tcs.output.report.score.tables import (
    goals_table,
    joints_table,
    pairs_table,
    reasons_table,
    stops_table,
    success_table,
    verification_table,
)
from tcs.output.words import goals_text
from tcs.placement.scoring import score
from tcs.placement.store import StateTables, load_scores, save_scores
from tcs.placement.tables import Reason, Window
from tests.environments import write_environment
from tests.output.report.test_page import Reader, column

FAR = {
    "base_x": (5, 0.1, 3),
    "base_y": (5, 0.1, 2),
    "base_yaw": (0, 90, 4),
    "torso": (0.15, 0.15, 1),
}
"""Base poses from which no goal is within reach."""
CHECK = CheckSizes(pairs=12, dense=6, seed=3)


@pytest.fixture(scope="module", autouse=True)
def _small_pictures():
    """Smaller pictures, which take a tenth of the time; their content is tested elsewhere."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tcs.output.draw.camera.SIZE", (300, 260))
        patch.setattr("tcs.output.report.score.report._DPI", 30)
        yield


@pytest.fixture(scope="module")
def report(score_path, _small_pictures):
    return make_score_report(score_path, sizes=CHECK)


def _leave_undrawn(patch):
    """Leave the pictures of stops empty, which take half of the time."""
    patch.setattr("tcs.output.report.score.report.member_figure", lambda *_: Figure())


@pytest.fixture
def undrawn(monkeypatch):
    """Pictures are not looked at: `report` has them drawn."""
    _leave_undrawn(monkeypatch)


@pytest.fixture(scope="module")
def single(score_path, _small_pictures):
    """A report on a single base pose, which does not reach every goal."""
    with pytest.MonkeyPatch.context() as patch:
        _leave_undrawn(patch)
        return make_score_report(score_path, max_members=1, sizes=CheckSizes(pairs=0, dense=0))


@pytest.fixture(scope="module")
def page(report):
    return make_score_page(report, command="tcs report f.tcs --out r.html")


def test_the_page_has_every_part_and_needs_nothing_else(page):
    html = as_html(page)
    reader = Reader()
    reader.feed(html)
    assert reader.open == []
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in reader.links)
    # A map, no states in a wheelchair, and a picture of each of the two stops.
    assert reader.tags.count("img") == 3
    wording = "".join(reader.text)
    for part in ("Summary", "Robot at each stop", "Goals", "Reasons over", "Verification"):
        assert part in wording
    assert "tcs report f.tcs --out r.html" in wording
    assert "Maps by environment state" not in wording
    assert as_markdown(page).count("\n## ") == len(page.sections)


def test_each_goal_is_reported_as_the_file_has_it(report, score_path):
    table, scores = goals_table(report), load_scores(score_path).nominal.scores
    members = list(report.shown.indices)
    best = scores.dexterity[members].argmax(axis=0)
    for goal, wording in enumerate(column(table, "Reached from")):
        reached = scores.reached[members, goal].any()
        assert wording == (f"stop {best[goal] + 1}" if reached else "nowhere")
    for number, h in enumerate(members):
        for goal, wording in enumerate(column(table, f"At stop {number + 1}")):
            if scores.reached[h, goal]:
                assert float(wording) == pytest.approx(scores.dexterity[h, goal], abs=5e-4)
            else:
                assert not wording[0].isdigit()
    share = scores.reached.mean(axis=0)
    for goal, wording in enumerate(column(table, "Of the grid")):
        assert float(wording.removesuffix("%")) == pytest.approx(100 * share[goal], abs=5.1e-3)
    reached = scores.reached[members].any(axis=0)
    assert column(table, "Drake") == ["confirmed" if one else "–" for one in reached]


def test_joints_and_stops_are_those_of_the_file(report):
    scores = report.scored.scores
    for row in joints_table(report).texts():
        goal, stop = int(row[0]) - 1, int(row[1]) - 1
        expected = np.degrees(scores.joints_of(report.shown.indices[stop], goal))
        np.testing.assert_allclose([float(cell) for cell in row[2:]], expected, atol=0.0051)
    table = stops_table(report)
    for number, member in enumerate(report.shown.members):
        assert float(column(table, "base x [m]")[number]) == pytest.approx(member.base_x, abs=5e-3)
        heading = math.degrees(member.base_yaw) % 360
        assert float(column(table, "heading [deg]")[number]) == pytest.approx(heading, abs=0.5)
    listed = ", ".join(column(table, "Serves goals")).split(", ")
    reached = [g for g, at in enumerate(report.assignment) if at is not None]
    assert sorted(listed) == sorted(f"{report.goal_names[g]} ({g + 1})" for g in reached)


def test_stops_are_listed_with_their_windows_if_these_are_known(report):
    assert "May be" not in {one.title for one in stops_table(report).columns}
    choice, count = report.shown.choice, len(report.shown.members)
    # In the order of the members, not of the tour.
    windows: list[Window | None] = [None] * count
    windows[choice.order[0]] = Window(0.04, 0.06, math.radians(5.0))
    choice = dataclasses.replace(choice, windows=tuple(windows))
    shown = dataclasses.replace(report.shown, choice=choice)
    table = stops_table(dataclasses.replace(report, shown=shown))
    expected = ["4 cm off in x, 6 cm in y, 5 degrees in heading"] + ["not known"] * (count - 1)
    assert column(table, "May be") == expected


def test_every_configuration_counts_once_for_each_goal(report):
    for row in reasons_table(report).texts():
        # Six percentages rounded to a hundredth.
        assert sum(float(cell) for cell in row[2:]) == pytest.approx(100.0, abs=0.03)
    scores = report.scored.scores
    counts = {}
    for row in pairs_table(report).texts():
        counts[row[0]] = counts.get(row[0], 0) + int(row[3].replace(",", ""))
    for name, reason in (
        ("body blocked", Reason.BODY_BLOCKED),
        ("arm blocked", Reason.ARM_BLOCKED),
    ):
        assert counts.get(name, 0) == np.count_nonzero(scores.reason == reason)


def test_goals_that_one_base_pose_misses_have_a_reason_and_a_change(single):
    assert single.unreached
    wording = as_markdown(make_score_page(single, command="c"))
    for goal in single.unreached:
        named = f"{single.goal_names[goal]} ({goal + 1})"
        assert f"The cheapest change from stop 1 that reaches goal {named} and loses " in wording
    assert f"Not reached: {goals_text(single.unreached, single.goal_names)}." in wording
    assert "Nothing was re-checked" in wording
    assert (
        "Recommended wherever the robot is now, of the sets of at most 1 in the file: the most "
        in wording
    )
    assert all(single.assignment[goal] is None for goal in single.unreached)
    assert [row for row in goals_table(single).texts() if row[2] == "nowhere"]


@pytest.mark.slow
def test_the_set_is_the_one_selected_from_here(score_path):
    here = InitialConfiguration(base_x=0.6, base_y=0.7, base_yaw=0.0, torso=0.0)
    found = make_score_report(score_path, here=here, sizes=CheckSizes(pairs=0, dense=0))
    wording = as_markdown(make_score_page(found, command="c"))
    assert "Recommended for a robot at x 0.60 m, y 0.70 m, heading 0 deg" in wording


@pytest.fixture(scope="module")
def false_path(score_path, tmp_path_factory):
    """The file with an error of one degree in one joint of all postures."""
    file = load_scores(score_path)
    scores = file.nominal.scores
    path = tmp_path_factory.mktemp("false") / "false.tcs"
    joints = scores.arm_joints + np.float32([0, 0, 0, math.radians(1.0), 0, 0, 0])
    wrong = dataclasses.replace(scores, arm_joints=joints)
    table = StateTables.of(wrong, file.nominal.sets)
    save_scores(path, dataclasses.replace(file, tables=(table,)))
    return path


@pytest.mark.slow
def test_a_false_answer_is_reported(false_path):
    found = make_score_report(false_path, sizes=CHECK)
    assert not found.is_sound
    assert set(column(goals_table(found), "Drake")) == {"REFUTED"}
    assert column(verification_table(found), "Result")[1] == "12"
    wording = as_markdown(make_score_page(found, command="c"))
    assert "SOME ANSWERS OF THE FILE ARE FALSE" in wording
    assert "every answer holds" not in wording


@pytest.mark.slow
def test_a_false_posture_that_only_the_report_shows_is_found(score_path, tmp_path):
    file = load_scores(score_path)
    scores = file.nominal.scores
    plain = dataclasses.replace(file, tables=(StateTables.of(scores, file.nominal.sets),))
    h = tcs.select(plain).indices[0]
    goal = int(scores.dexterity[h].argmax())
    row = np.flatnonzero(np.flatnonzero(scores.reached) == h * scores.goals + goal)
    joints = scores.arm_joints.copy()
    joints[row, 0] += np.float32(0.01)
    path = tmp_path / "one.tcs"
    table = StateTables.of(dataclasses.replace(scores, arm_joints=joints), file.nominal.sets)
    save_scores(path, dataclasses.replace(file, tables=(table,)))
    # Nothing is drawn at random.
    found = make_score_report(path, sizes=CheckSizes(pairs=0, dense=0))
    assert found.verification.is_sound
    assert not found.is_sound
    assert [g for g in found.findings if not found.is_confirmed(g)] == [goal]
    assert column(verification_table(found), "Result")[-1].startswith(
        "THESE ANSWERS HOLD, BUT SOME"
    )


def test_the_number_of_checks_is_reported(report):
    found = dict(
        zip(*(column(verification_table(report), t) for t in ("Check", "Result")), strict=True)
    )
    assert found["Reached pairs re-checked with Drake"] == "12"
    assert found["– false"] == "0"
    assert found["Verdict"] == "every answer holds"
    assert "seed 3" in verification_table(report).caption


def test_estimates_of_success_are_those_of_the_file(report):
    success, table = report.success, success_table(report)
    assert success is not None
    for name, most in (("most robust set of one", 1), ("most robust set of up to 2", 2)):
        row = success.row_of(success.most_robust(report.scored.sets, max_members=most))
        wording = column(table, "Under error")[column(table, "Set").index(name)]
        assert float(wording.removesuffix("%")) == pytest.approx(
            100 * success.success[row], abs=0.051
        )
        ends = column(table, "95% interval")[column(table, "Set").index(name)].split(" to ")
        assert list(map(float, ends)) == pytest.approx(
            [100 * success.low[row], 100 * success.high[row]], abs=0.051
        )
    file = dataclasses.replace(
        report.file, tables=tuple(StateTables.of(t.scores, t.sets) for t in report.file.tables)
    )
    plain = dataclasses.replace(report, file=file)
    assert success_table(plain) is None
    assert "tcs robustify" in as_markdown(make_score_page(plain, command="c"))


def test_data_files_are_named_as_they_were_given(report, tmp_path, monkeypatch):
    own = tmp_path / "mine.yaml"
    located = {**report.file.metadata, "robot": str(own)}
    file = dataclasses.replace(
        report.file, metadata={**located, "given": {"robot": "mine.yaml", "task": "shaving"}}
    )
    monkeypatch.chdir(tmp_path)
    assert (as_given(file, "robot"), as_given(file, "task")) == ("mine.yaml", "shaving")
    # From another folder the relative path would be invalid.
    monkeypatch.chdir(tmp_path.parent)
    assert as_given(file, "robot") == str(own)


def test_commands_make_the_same_again(report, score_path):
    words = shlex.split(score_command(report))
    environment = str(score_path.parent / "small-wheelchair.yaml")
    assert words[:7] == ["tcs", "score", "shaving", "--environment", environment, "--robot", "pr2"]
    words.remove("--paper")
    options = dict(zip(words[7::2], words[8::2], strict=True))
    assert options == {
        "--measure": "isotropy",
        "--rules": "paper",
        "--max-members": "2",
        "--out": str(score_path),
    }
    wording = robustify_command(report)
    assert wording == f"tcs robustify {score_path} --sets 12 --samples 32 --seed 0"
    digest = hashlib.sha256(score_path.read_bytes()).hexdigest()
    made = as_markdown(make_score_page(report, command="c"))
    assert digest in made
    assert report.file.metadata["scene_digest"] in made


def test_on_the_command_line(score_path, tmp_path, undrawn):
    out = tmp_path / "page.html"
    words = ("report", score_path, "--out", out, "--md", "--pairs", 3, "--dense", 2, "--json")
    ran = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert ran.exit_code == 0
    reported = json.loads(ran.stdout)
    assert reported["files"] == [str(out), str(out.with_suffix(".md"))]
    assert reported["bytes"] == [path.stat().st_size for path in (out, out.with_suffix(".md"))]
    assert reported["is_sound"] is True
    assert reported["verification"]["checked"] == 3
    assert out.read_text().startswith("<!doctype html>")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.html", "page.md"]


def test_a_file_without_reached_goals_has_a_page(tmp_path):
    path = tmp_path / "far.tcs"
    save_scores(path, score("shaving", write_environment(tmp_path, "far", FAR), paper=True))
    found = make_score_report(path, sizes=CHECK)
    assert found.is_sound
    wording = as_markdown(make_score_page(found, command="c"))
    assert "No configuration of the grid reaches any of the 8 goals" in wording
    assert wording.count("that passed the most checks: too far for the arm.") == 2
    assert "Nothing was re-checked with Drake." in wording
    # No claim about answers that nothing was checked for.
    assert "every answer holds" not in wording
    assert column(verification_table(found), "Result")[-1] == found.verification.verdict
    assert found.views == ()


def test_a_false_answer_ends_in_an_exit_code(false_path, tmp_path, undrawn):
    out = tmp_path / "page.md"
    words = ("report", false_path, "--out", out, "--pairs", 2, "--dense", 0)
    ran = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert ran.exit_code == 1
    assert "some answers in" in ran.stderr
    assert "SOME ANSWERS OF THE FILE ARE FALSE" in out.read_text()


@pytest.mark.slow
def test_a_measure_that_is_not_that_of_the_posture_is_found(score_path, tmp_path):
    file = load_scores(score_path)
    scores = file.nominal.scores
    better = np.where(scores.reached, scores.dexterity + np.float32(1e-3), scores.dexterity)
    table = StateTables.of(
        dataclasses.replace(scores, dexterity=better),
        dataclasses.replace(
            file.nominal.sets,
            dexterity=np.where(
                file.nominal.sets.reached,
                file.nominal.sets.dexterity + np.float32(1e-3),
                file.nominal.sets.dexterity,
            ),
        ),
    )
    path = tmp_path / "better.tcs"
    save_scores(path, dataclasses.replace(file, tables=(table,)))
    found = make_score_report(path, sizes=CheckSizes(pairs=0, dense=0))
    assert all(one.is_true for one in found.findings.values())
    assert not found.is_sound


def test_the_person_is_named_with_the_command(report):
    person = load_person({"sex": "female", "stature": 1.6}).to_json()
    file = dataclasses.replace(report.file, metadata={**report.file.metadata, "person": person})
    hers = dataclasses.replace(report, file=file)
    words = shlex.split(score_command(hers))
    given = [words[i + 1] for i, word in enumerate(words) if word == "--person"]
    assert given == ["sex=female", "stature=1.6"]
    shown = as_markdown(make_score_page(hers, command="c"))
    assert "Scored for a woman of 1.600 m" in shown
