"""Options with values that no measurement has end in one line, not in a traceback or a hang."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import pytest
from typer.main import get_command

from tcs.capability import save_map
from tcs.capability.arplace import query, save_arplace, save_probability_map
from tcs.cli.app import app
from tcs.teleop.runs.run_files import save_run
from tests.capability.arplace.example import model
from tests.capability.test_map import small_map
from tests.teleop.runs.test_run_files import made

NUMBERS = ("nan", "-inf", "-1", "0", "1e150", "1e-300", "")
INTEGERS = ("-1", "0", "9" * 23, "2147483648", "nan", "")
TEXTS = (
    *("", "nonsense", "a" * 5000, "=", "=1", "x=nan", "head=nan,0,0", "~unknown-user/x", "a/b/c"),
    *("a\0b", "pipe"),
)
VALUES_EACH = 2
"""Values that one option gets; in turn, so that the options of a type get all of them together.
`benchmarks/fuzz_options.py` gives every value to every option of every command."""


@pytest.fixture
def base(tmp_path, monkeypatch, small_file):
    """For each quick command, words with which it runs; every path lies in a temporary folder."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    save_map(
        tmp_path / "map.tcm", small_map([[0, 0, 0, 0, 0], [1, 2, 3, 4, 1]], [0.5, 0.25], [1, 1])
    )
    save_run(tmp_path / "run.csv", made())
    save_arplace(tmp_path / "discs.arp", model())
    save_probability_map(tmp_path / "discs.apm", query(model()).map)
    return {
        "select": [small_file, "--here", "1", "0.3", "180"],
        "explain": [small_file, "--goal", "1"],
        "export": [small_file, "--out", "out.csv"],
        "map": [small_file, "--out", "map.png"],
        "capability show": ["map.tcm", "--out", "layer.png"],
        "capability merge": ["map.tcm", "--task", "pick-and-place", "--height", "0.4"],
        "arplace query": ["discs.arp", "--std", "0.05"],
        "arplace merge": ["discs.apm", "discs.apm"],
        "arplace show": ["discs.arp", "--out", "modes.png"],
        "teleop replay": ["run.csv", "--robot", "nonsense", "--export", "page.html"],
    }


def command(name):
    found = get_command(app)
    for word in name.split():
        found = found.commands[word]
    return found


@pytest.mark.parametrize(
    "name",
    [
        *("select", "explain", "export", "map", "capability show", "capability merge"),
        *("arplace query", "arplace merge", "arplace show", "teleop replay"),
    ],
)
def test_odd_values_of_every_option_are_one_line(tcs_command, base, name):
    numbers, integers, texts = (itertools.cycle(v) for v in (NUMBERS, INTEGERS, TEXTS))
    calls = 0
    for parameter in command(name).params:
        if parameter.param_type_name != "option" or parameter.is_flag or parameter.name == "help":
            continue
        annotation = str(parameter.type_descriptor.annotation)
        values = numbers if "float" in annotation else integers if "int" in annotation else texts
        for value in itertools.islice(values, VALUES_EACH):
            words = (parameter.opts[0], *[value] * max(parameter.nargs, 1))
            # The later one of two options counts. An exception other than an exit is raised here.
            ran = tcs_command(*name.split(), *base[name], *words)
            assert ran.code in (0, 1, 2), words
            if ran.code == 1:
                assert len(ran.err.strip().splitlines()) == 1, (words, ran.err)
            calls += 1
    assert calls >= VALUES_EACH


@pytest.mark.parametrize("name", ["evaluate", "robustify"])
@pytest.mark.parametrize("option", ["--samples", "--sets", "--seed", "--jobs"])
def test_odd_counts_are_refused_before_the_scene_is_built(tcs_command, small_file, name, option):
    if (name, option) == ("evaluate", "--sets"):
        pytest.skip("has no such option")
    for value in ("-1", "9" * 23, "nan", ""):
        ran = tcs_command(name, small_file, option, value)
        assert ran.code in (1, 2), value
        assert ran.code == 2 or len(ran.err.strip().splitlines()) == 1, ran.err


@pytest.mark.parametrize("jobs", ["1025", "9" * 23])
def test_more_jobs_than_any_machine_has_are_misuse(tcs_command, small_file, jobs):
    """Before, joblib raised ValueError for the literal."""
    ran = tcs_command("robustify", small_file, "--jobs", jobs)
    assert ran.code == 2
    assert "1024" in ran.err


@pytest.mark.parametrize(
    ("words", "quantity"),
    [
        (("--radius", "1e150"), "radius"),
        (("--radius", "nan"), "radius"),
        (("--step", "1e-300"), "step"),
        (("--yaw-bins", "2147483648"), "yaw bins"),
    ],
)
def test_a_map_of_impossible_size_is_refused_before_the_memory_is_full(
    tcs_command, tmp_path, words, quantity
):
    ran = tcs_command(
        "capability", "from-ik", "--robot", "iiwa7", "--type", "ICM", "--grasps", "all",
        "--out", tmp_path / "map.tcm", *words,
    )  # fmt: skip
    assert ran.code == 1
    assert quantity in ran.err
    assert len(ran.err.strip().splitlines()) == 1


def test_an_unknown_home_folder_of_the_cache_is_one_line(process, tmp_path):
    ran = process(
        "score", "nothing.yaml", before="import os; os.environ['TCS_CACHE_DIR'] = '~unknown-user/x'"
    )
    assert "Traceback" not in ran.err
    assert ran.code == 1


@pytest.mark.parametrize("given", ["small.tcs", "./small.tcs", "link.tcs"])
def test_an_output_does_not_replace_what_is_read(tcs_command, small_file, monkeypatch, given):
    monkeypatch.chdir(small_file.parent)
    os.link(small_file, "link.tcs")
    before = small_file.read_bytes()
    for words in (("export", small_file), ("score", small_file)):
        ran = tcs_command(*words, "--out", given)
        assert ran.code == 1
        assert ran.err == (
            f"tcs: '{Path(given)}' is also read, and would be replaced. Name another file.\n"
        )
    assert small_file.read_bytes() == before


def test_a_map_does_not_replace_its_recording(tcs_command, tmp_path):
    csv = tmp_path / "recording.csv"
    csv.write_text("joint\n0\n")
    for option in ("--out", "--text"):
        files = {"--out": tmp_path / "map.tcm", option: csv}
        words = [word for pair in files.items() for word in pair]
        ran = tcs_command("capability", "record", csv, *words)
        assert (ran.code, "would be replaced" in ran.err) == (1, True)


@pytest.mark.parametrize("seconds", ["inf", "1e308", "nan", "-1"])
@pytest.mark.parametrize("name", ["view", "teleop replay"])
def test_an_endless_duration_is_misuse(tcs_command, base, small_file, name, seconds):
    """Before, the viewer ran until Ctrl-C."""
    file = small_file if name == "view" else "run.csv"
    ran = tcs_command(*name.split(), file, "--no-browser", "--duration", seconds)
    assert ran.code == 2
    assert "--duration" in ran.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("explain", ""), "an argument is empty."),
        (("explain", "small.tcs", "--goal", ""), "Invalid value for --goal: is empty."),
        (("evaluate", "small.tcs", "--body-collisions", ""), "for --body-collisions: is empty."),
        (("export", "small.tcs", "--out="), "Invalid value for --out: is empty."),
    ],
)
def test_empty_texts_are_misuse(tcs_command, words, message):
    """Before, they were the current folder or the default."""
    ran = tcs_command(*words)
    assert ran.code == 2
    assert message in ran.err


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--start-deg", "nan"), 1, "start or end is nan rad"),
        (("--samples", "0"), 1, "0 samples; must be at least 1."),
        (("--task-at", "nan", "0", "0"), 2, "requires --environment"),
        (("--robot", "nonsense"), 2, "requires --environment"),
    ],
)
def test_options_that_a_merge_does_not_use_are_checked(tcs_command, base, words, code, message):
    ran = tcs_command("capability", "merge", *base["capability merge"], *words)
    assert ran.code == code
    assert message in ran.err


@pytest.mark.parametrize(
    "words",
    [
        ("map-check", "map.tcm", "--step", "nan"),
        ("map-check", "map.tcm", "--radius", "-1"),
        ("map-check", "map.tcm", "--tool", "nonsense"),
        ("capability", "record", "run.csv", "--out", "out.tcm", "--seconds", "nan"),
        ("capability", "record", "run.csv", "--out", "out.tcm", "--save-csv", "pipe"),
    ],
    ids=" ".join,
)
def test_options_that_a_given_file_replaces_are_misuse(tcs_command, base, words):
    """Before, they had no effect."""
    ran = tcs_command(*words)
    assert ran.code == 2
    assert "leave" in ran.err
