"""Commands that draw: input rejected before any work."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize("verb", ["map", "picture", "report"])
def test_a_missing_file_is_one_line(tcs_command, tmp_path, verb):
    ending = "html" if verb == "report" else "png"
    ran = tcs_command(verb, tmp_path / "no.tcs", "--out", tmp_path / f"x.{ending}")
    assert ran.code == 1
    assert "no.tcs" in ran.err
    assert ran.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("verb", "out", "message"),
    [
        ("map", "map.gif", "must end in one of .png, .pdf, .svg"),
        ("report", "page.pdf", "must end in one of .html, .md"),
        ("report", "page", "must end in one of .html, .md"),
        ("report", "none/page.html", "cannot be written"),
        ("map", "none/map.png", "cannot be written"),
    ],
)
def test_a_file_that_cannot_be_written_is_one_line(tcs_command, small_file, verb, out, message):
    ran = tcs_command(verb, small_file, "--out", small_file.parent / out)
    assert ran.code == 1
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_scores_of_other_models_are_refused(tcs_command, small_file):
    # The scene digest of the example matches no model.
    ran = tcs_command("report", small_file, "--out", small_file.parent / "page.html")
    assert ran.code == 1
    assert "from other models" in ran.err
    assert [path.name for path in small_file.parent.iterdir()] == [small_file.name]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--score", "reachability"), "requires --states"),
        (("--states", "--score", "success"), "must be one of reachability"),
        (("--torso", 0.1), "requires --here"),
    ],
)
def test_options_that_do_not_go_together_are_misuse(tcs_command, small_file, words, message):
    ran = tcs_command("map", small_file, "--out", small_file.parent / "m.png", *words)
    assert ran.code == 2
    assert message in ran.err


def test_unknown_observed_axis_is_one_line(tcs_command, small_file):
    words = ("--out", small_file.parent / "page.html", "--observed", "person_z=0")
    ran = tcs_command("report", small_file, *words)
    assert ran.code == 1
    assert "person_z" in ran.err
