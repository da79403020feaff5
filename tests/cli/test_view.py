from __future__ import annotations

import re

import pytest


def test_meshes_and_json_are_for_pages_only(tcs_command, small_file):
    for option in ("--meshes", "--json"):
        ran = tcs_command("view", small_file, option)
        assert ran.code == 2
        assert "--export" in ran.err


def test_a_page_that_cannot_be_written_is_reported_before_the_work(tcs_command, tmp_path):
    ran = tcs_command("view", tmp_path / "no.tcs", "--export", tmp_path / "none" / "x.html")
    assert ran.code == 1
    assert "cannot be written" in ran.err


def test_a_page_of_another_name_is_not_written(tcs_command, small_file, tmp_path):
    ran = tcs_command("view", small_file, "--export", tmp_path / "scene.png")
    assert ran.code == 1
    assert "must end in .html" in ran.err


def test_scores_of_other_models_are_not_shown(tcs_command, small_file, tmp_path):
    page = tmp_path / "scene.html"
    ran = tcs_command("view", small_file, "--export", page)
    assert ran.code == 1
    assert "Score the task again" in ran.err
    assert not page.exists()


def test_a_score_file_is_opened_on_the_page(tcs_command, small_file):
    ran = tcs_command("view", small_file, "--no-browser", "--duration", 0.1)
    assert ran.code == 0
    assert "open http://127.0.0.1:" in ran.err
    here = ("--here", 1.5, -0.25, 90, "--torso", 0.3)
    ran = tcs_command("view", small_file, *here, "--no-browser", "--duration", 0.1)
    assert ran.code == 0
    assert "&x=1.5&y=-0.25&yaw=90&torso=0.3 in a browser" in ran.err


@pytest.mark.parametrize("options", [("--meshcat",), ("--max-members", 1), ("--no-refined",)])
def test_a_set_that_is_named_is_shown_in_meshcat(tcs_command, small_file, options):
    # Only Meshcat shows the scene itself, and so refuses scores of other models.
    ran = tcs_command("view", small_file, *options, "--no-browser", "--duration", 0.1)
    assert ran.code == 1
    assert "Score the task again" in ran.err


@pytest.mark.slow
def test_a_scored_task_can_be_viewed_and_exported(process, tmp_path):
    file, page = tmp_path / "feeding.tcs", tmp_path / "scene.html"
    assert process("score", "feeding", "--out", file).code == 0
    ran = process("view", file, "--meshcat", "--no-browser", "--duration", 0.1)
    assert ran.code == 0
    assert re.search(r"on the person.s .*; goal .* reached; ", ran.out)
    assert "http://localhost:" in ran.err
    ran = process("view", file, "--export", page, "--meshes", "--json")
    assert ran.code == 0
    assert ran.json["bytes"] == page.stat().st_size < 15e6
    assert "pr2_description" in ran.json["source"]
    assert "pr2_description" in page.read_text()
    ran = process("view", file, "--export", page)
    assert ran.code == 0
    assert page.stat().st_size < 3e6
    assert "pr2_description" not in page.read_text()
