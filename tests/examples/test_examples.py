"""Every example runs in an empty folder and prints what its comments promise."""

import re
import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))

# What each must print, as one expression over all lines, and the files it writes.
PRINTED = {
    "01_score_and_select": r"y 1 m, reaching 100% of the goals:\n.*base_x.*y -1 m, reaching 100%",
    "02_own_environment": r"wheelchair:\n  7,\d{3} pairs.*kitchen:\n  [1-4],\d{3} pairs",
    "03_own_task": r"3 goals, weights \[0.25, 0.25, 0.5\].*\[True, True, True\]",
    "04_another_robot": r"pr2: 75%.*pr2_spoon: \d+%.*panda: \d+%",
    "05_observed_person": r"used \{'person_y': 0.0\}.*used \{'person_y': 0.1\}.*is 0.010 m from "
    r"its position at the shift \{'person_y': -0.1\}",
    "06_robustness": r"single: \d+\.\d%.*best: \d+\.\d%.*: (9\d\.\d|100\.0)% estimated",
    "07_explain": r"goal 1: arm_blocked, l_upper_arm_link would touch .* Drive 5 cm back"
    r".*goal 4: reached\ngoal 5: joint_limits\. Raise the torso 15 cm",
    "08_capability_map": r"[1-9]\d* base poses reach both.*score 0\.[1-9]",
    "09_live_score": r"observed joint: 100%.*observed frame: 100%",
    "10_viewer_page": r"wrote .*feeding\.html, [23]\.\d MB",
    "11_drive_an_arm": r"^4\.0 s, 1\.45 m up: joint 6 is at its limit.*the tool by 0\.0\d\d mm\n"
    r"8\.\d s, 1\.5\d m up",
    "12_turn_the_head": r"0 deg: 75% .*60 deg: 100% .*head_turn_deg",
    "13_arm_on_the_wheelchair": r"^86% of the goals with the arm 0\.\d\d m ahead .* by \d+ deg$",
    "14_wash_the_trunk": r"^2\d goals, .*one base pose: 14%\nreached from two: 24%",
    "15_hold_and_wipe": r"^by both arms from one base pose: 100%\n.*20 re-checked, 0 false",
    "16_arm_of_five_joints": r"^71% of the goals with the arm 0\.\d\d m ahead .*\n"
    r"100 re-checked with Drake, 0 false; 20 unreached ones scanned, 0 missed",
}
WRITTEN = {
    "01_score_and_select": ["feeding.tcs"],
    "08_capability_map": ["tiago.tcm"],
    "10_viewer_page": ["feeding.html"],
}
SLOW = ("01", "02", "04", "05", "06", "12", "13", "15", "16")
"""Examples that take longest; `make wheel` runs them too."""


def marked(path):
    slow = [pytest.mark.slow] if path.stem.startswith(SLOW) else []
    return pytest.param(path, id=path.stem, marks=slow)


@pytest.mark.parametrize("path", [marked(path) for path in SCRIPTS])
def test_example_runs(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    printed = capsys.readouterr().out
    assert re.search(PRINTED[path.stem], printed, flags=re.S), printed
    left = sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*") if file.is_file())
    assert left == [f"out/examples/{name}" for name in WRITTEN.get(path.stem, [])]


def test_numbers_have_no_gap():
    assert [path.name[:3] for path in SCRIPTS] == [f"{n:02d}_" for n in range(1, len(SCRIPTS) + 1)]


def test_the_docs_show_all():
    page = (EXAMPLES.parent / "docs" / "examples.md").read_text(encoding="utf-8")
    shown = re.findall(r"\.\./examples/(\S+)", page)
    assert sorted(shown) == sorted(path.name for path in EXAMPLES.iterdir() if path.is_file())


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.name)
def test_data_file_belongs_to_an_example(path):
    assert any(f'"{path.name}"' in script.read_text(encoding="utf-8") for script in SCRIPTS)
