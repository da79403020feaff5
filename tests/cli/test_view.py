from __future__ import annotations

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


@pytest.mark.slow
def test_a_scored_task_can_be_viewed_and_exported(process, tmp_path):
    file, page = tmp_path / "feeding.tcs", tmp_path / "scene.html"
    assert process("score", "feeding", "--out", file).code == 0
    ran = process("view", file, "--no-browser", "--duration", 0.1)
    assert ran.code == 0
    assert "member 1 of 2: goal " in ran.out
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
