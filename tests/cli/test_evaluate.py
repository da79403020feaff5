"""`tcs evaluate` and `tcs robustify`: output, files and errors."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time

import pytest

import tcs
from tcs.placement.robustness import success_summary
from tests.beside import BESIDE
from tests.placement.store.example import score_file


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beside")
    environment = folder / "beside.yaml"
    environment.write_text(BESIDE)
    path = folder / "beside.tcs"
    tcs.save(path, tcs.score("shaving", environment, paper=True))
    return path


@pytest.mark.parametrize(
    ("words", "options"),
    [
        ((), {}),
        (("--select", "single", "--seed", 3, "--jobs", 1), {"select": "single", "seed": 3}),
        (("--select", "uniform", "--members", 1), {"select": "uniform", "members": 1}),
        (("--body-collisions", "paper"), {"body_collisions": "paper"}),
        (("--body-collisions", "none"), {"body_collisions": "none"}),
    ],
    ids=str,
)
def test_json_is_what_python_returns(tcs_command, stored, words, options):
    ran = tcs_command("evaluate", stored, "--samples", 40, *words, "--json")
    assert (ran.code, ran.err) == (0, "")
    expected = tcs.evaluate(tcs.load(stored), samples=40, **options).to_json()
    printed = ran.json
    assert printed.pop("seconds") > 0
    expected.pop("seconds")
    assert printed == expected


@pytest.mark.parametrize("select", ["best", "uniform"])
def test_a_single_sample_has_no_interval(tcs_command, stored, select):
    words = ("evaluate", stored, "--samples", 1, "--select", select)
    ran = tcs_command(*words, "--json")
    assert ran.code == 0
    # Python reads NaN, which is not JSON.
    found = json.loads(ran.out, parse_constant=pytest.fail)
    assert found["ci95"] is None
    assert 0.0 <= found["mean"] <= 1.0
    # That of the fraction of rooms is exact, also of a single one.
    assert f"under error {found['mean']:.1%} of the goals, " in tcs_command(*words).out


def test_the_text_shows_the_mean_and_the_errors(tcs_command, stored):
    ran = tcs_command("evaluate", stored, "--samples", 40)
    found = tcs.evaluate(tcs.load(stored), samples=40)
    assert f"under error {found.summary.mean:.1%} of the goals" in ran.out
    # Lines may break anywhere between words.
    text = " ".join(ran.out.split())
    assert "person_yaw standard deviation 5 deg" in text
    assert "collisions of the robot's body count" in text


def test_an_error_file_takes_the_place_of_the_environments(tcs_command, stored, tmp_path):
    path = tmp_path / "errors.yaml"
    path.write_text("errors: {person_x: {distribution: uniform, half_width: 0.01}}\n")
    found = tcs_command("evaluate", stored, "--errors", path, "--samples", 5, "--json").json
    assert found["errors"] == {"person_x": {"distribution": "uniform", "half_width": 0.01}}


def test_a_misspelt_joint_is_named_with_the_nearest(tcs_command, stored, tmp_path):
    path = tmp_path / "errors.yaml"
    path.write_text("errors: {head_tlit: {distribution: normal, std_deg: 5}}\n")
    ran = tcs_command("evaluate", stored, "--errors", path)
    assert (ran.code, ran.out) == (1, "")
    assert "Did you mean 'head_tilt'?" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--samples", 0), 1, "samples is 0; must be a whole number, 1 to 1,000,000."),
        (("--select", "bets"), 1, "Did you mean 'best'?"),
        (("--members", 1), 2, "--members"),
        (("--observed", "person_y=0.1"), 1, "unknown observed axis 'person_y'"),
        (("--errors", "nowhere.yaml"), 1, "nowhere.yaml' cannot be read"),
    ],
    ids=str,
)
def test_invalid_options_are_refused(tcs_command, stored, words, code, message):
    ran = tcs_command("evaluate", stored, *words)
    assert (ran.code, ran.out) == (code, "")
    assert message in ran.err


def test_a_file_of_other_models_is_refused(tcs_command, tmp_path):
    path = tmp_path / "old.tcs"
    tcs.save(path, score_file())
    ran = tcs_command("evaluate", path)
    assert ran.code == 1
    assert "were made by tcs 0.1.0 from other models" in ran.err


def test_robustify_writes_estimates_that_select_weighs(tcs_command, stored, tmp_path):
    out = tmp_path / "robust.tcs"
    words = ("--samples", 70, "--sets", 20, "--out", out)
    ran = tcs_command("robustify", stored, *words, "--json")
    assert (ran.code, ran.err) == (0, "")
    made = tcs.robustify(tcs.load(stored), samples=70, sets=20)
    expected = success_summary(made)
    assert ran.json == {"file": str(out), **expected}
    here = ("--here", 1.4, -1.2, 180)
    choice = tcs_command("select", out, *here, "--delta", 10_000, "--json").json
    assert choice["success_ci95"][0] == made.nominal.success.low.max()
    assert "under error" in tcs_command("select", out, *here, "--delta", 10_000).out
    assert tcs.load(stored).nominal.success is None
    robust = tcs_command("evaluate", out, "--select", "robust", "--samples", 5, "--json").json
    best = expected["tables"][0]["best"][-1]["members"]
    assert robust["members"] in (best, expected["tables"][0]["best"][0]["members"])


def test_robustify_prints_the_most_robust_sets(tcs_command, stored, tmp_path):
    out = tmp_path / "robust.tcs"
    ran = tcs_command("robustify", stored, "--samples", 64, "--sets", 8, "--out", out)
    assert ran.code == 0
    assert "of 1" in ran.out
    # The suggested command works with a base pose filled in.
    *words, last = ran.out.splitlines()[-1].split()
    words = [{"X": "1.4", "Y": "-1.2", "YAW_DEG": "180"}.get(word, word) for word in words]
    assert words[:2] == ["tcs", "select"]
    assert tcs_command(*words[1:], last).code == 0


def test_delta_and_robust_need_estimates(tcs_command, stored):
    ran = tcs_command("select", stored, "--here", 1, 0, 0, "--delta", 1)
    assert ran.code == 1
    assert "Estimate it first: tcs robustify FILE." in ran.err
    ran = tcs_command("evaluate", stored, "--select", "robust")
    assert ran.code == 1
    assert "Estimate it first: tcs robustify FILE." in ran.err


def test_selecting_by_success_loads_nothing_heavy(process, tcs_command, stored, tmp_path):
    out = tmp_path / "robust.tcs"
    tcs_command("robustify", stored, "--samples", 64, "--sets", 8, "--out", out)
    before = (
        "import atexit; atexit.register(lambda: print([m for m in ('pydrake', 'numba', 'scipy', "
        "'matplotlib', 'pandas', 'trimesh') if m in sys.modules], file=sys.stderr))"
    )
    ran = process("select", out, "--here", 1, 0, 0, "--delta", 1, before=before)
    assert ran.code == 0
    assert ran.err.strip() == "[]"


def test_an_interrupt_ends_in_one_line_and_leaves_the_file(stored, tmp_path):
    path = tmp_path / "robust.tcs"
    path.write_bytes(stored.read_bytes())
    words = [sys.executable, "-m", "tcs", "robustify", str(path), "--samples", "100000"]
    running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(4.0)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert (running.returncode, out) == (130, "")
    assert err == "tcs: interrupted; no half-written file is left.\n"
    assert path.read_bytes() == stored.read_bytes()
    assert sorted(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "words",
    [
        ("evaluate", "{file}", "--samples", "20"),
        # `test_kept_runs`, `test_kept_people` and `test_kept_outcomes` have the same of these
        # three, without the command line.
        *(
            pytest.param(words, marks=pytest.mark.slow)
            for words in (
                ("robustify", "{file}", "--samples", "8", "--sets", "8", "--out", "{out}"),
                ("population", "{file}", "--bodies", "3", "--sets", "1"),
                ("motions", "{file}", "--most", "1", "--out", "{out}"),
            )
        ),
        ("capability", "from-ik", "--step", "0.2", "--radius", "0.5", "--out", "{out}"),
    ],
    ids=lambda words: words[0],
)
def test_blocks_are_kept_and_taken(words, tcs_command, stored, tmp_path):
    words = [word.format(file=stored, out=tmp_path / "out.tcs") for word in words]
    first = without_time(tcs_command(*words, "--json").json)
    blocks = tmp_path / "blocks"
    for more in ((), (), ("--restart",)):
        ran = tcs_command(*words, "--blocks", blocks, *more, "--json")
        assert without_time(ran.json) == first
    (manifest,) = blocks.rglob("manifest.json")
    assert tcs_command("check", manifest, *blocks.rglob("*.block")).code == 0
    ran = tcs_command(*words, "--restart")
    assert ran.code == 2
    assert "requires --blocks" in " ".join(ran.err.replace("│", " ").split())


def without_time(result):
    return {key: value for key, value in result.items() if not key.endswith("seconds")}


def test_blocks_are_not_for_refined_sets(tcs_command, stored, tmp_path):
    ran = tcs_command("evaluate", stored, "--select", "refined", "--blocks", tmp_path / "blocks")
    assert ran.code == 2
    assert "not for refined sets" in " ".join(ran.err.replace("│", " ").split())
