"""Every measured table in README and docs is what the benchmarks saved."""

import importlib.util
import json
import re
import shutil
import sys
from pathlib import Path

import pytest
import yaml

CHECKOUT = Path(__file__).resolve().parents[2]
SAVED = sorted((CHECKOUT / "benchmarks" / "figures").glob("*.json"))


@pytest.fixture(scope="module")
def figures():
    """Return the script as a module."""
    spec = importlib.util.spec_from_file_location("figures", CHECKOUT / "scripts" / "figures.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_no_page_differs_from_the_saved_figures(figures):
    differing = [
        page.name
        for page in figures.pages()
        if figures.rewritten(text := page.read_text(encoding="utf-8")) != text
    ]
    assert differing == [], "run `make figures`"


def test_every_block_and_cell_is_read(figures):
    # A block with a mistyped opening would not be checked.
    for page in figures.pages():
        text = page.read_text(encoding="utf-8")
        found = len(figures.BLOCK.findall(text)) + len(figures.CELL.findall(text))
        assert found == len(re.findall(r"<!--\s*figures?\b", text)), page
        # A comment at the start of a line would end the paragraph.
        assert not re.search(r"^ *<!-- figure:", text, flags=re.M), page


def test_an_edited_figure_is_noticed(figures):
    # A block that has not been saved yet keeps its text.
    texts = [page.read_text(encoding="utf-8") for page in figures.pages()]
    text, end = next(
        (text, match.end() - len(figures.END))
        for text in texts
        for match in figures.BLOCK.finditer(text)
        if figures.is_saved(match[2], match[3])
    )
    forged = text[:end] + "| forged | 1 |\n" + text[end:]
    assert figures.rewritten(forged) == text


def test_check_writes_nothing_and_fails(figures, tmp_path, monkeypatch, capsys):
    (tmp_path / "docs").mkdir()
    shutil.copytree(CHECKOUT / "benchmarks" / "figures", tmp_path / "benchmarks" / "figures")
    script, saved = SAVED[0].stem, json.loads(SAVED[0].read_text(encoding="utf-8"))
    page = tmp_path / "docs" / "page.md"
    stale = f"<!-- figures: {script}/{next(iter(saved['tables']))} -->\n{figures.END}\n"
    page.write_text(stale, encoding="utf-8")
    (tmp_path / "README.md").write_text("# tcs\n", encoding="utf-8")
    monkeypatch.setattr(figures, "CHECKOUT", tmp_path)
    monkeypatch.setattr(figures, "FIGURES", tmp_path / "benchmarks" / "figures")
    monkeypatch.setattr(sys, "argv", ["figures.py", "--check"])
    assert figures.main() == 1
    assert page.read_text(encoding="utf-8") == stale
    assert "page.md: differs" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["figures.py"])
    assert figures.main() == 0
    assert saved["machine"] in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", SAVED, ids=lambda path: path.stem)
def test_saved_figures_state_machine_and_versions(path):
    saved = json.loads(path.read_text(encoding="utf-8"))
    assert {"command", "date", "machine", "load", "python", "versions"} <= set(saved)
    assert (CHECKOUT / saved["command"].split()[1]).is_file()
    assert saved["tables"]


def test_every_block_and_cell_is_saved(figures):
    pages = (page.read_text(encoding="utf-8") for page in figures.pages())
    assert set().union(*map(figures.unsaved, pages)) == set()


def test_one_command_saves_every_block_and_cell(figures, monkeypatch):
    monkeypatch.syspath_prepend(str(CHECKOUT / "benchmarks"))
    parts = importlib.import_module("save_all").PARTS
    for page in figures.pages():
        text = page.read_text(encoding="utf-8")
        for pattern in (figures.BLOCK, figures.CELL):
            assert {match[1] for match in pattern.findall(text)} <= set(parts), page


PAGE = """# Measured
It takes <!-- figure: made/times | step | median [ms] -->9<!-- --> ms.

<!-- figures: made/times -->
<!-- end of figures -->

<!-- figures: made/times -->
<!-- end of figures -->

## Output
<!-- figures: made/output -->
<!-- end of figures -->
"""


@pytest.fixture
def made(figures, tmp_path, monkeypatch):
    """Return the script with saved figures of a made-up benchmark."""
    tables = {
        "times": {"columns": ["", "median [ms]"], "rows": [["step", "0.4"]]},
        "output": {"text": "all done"},
    }
    where = dict.fromkeys(("date", "machine", "load", "python", "versions"), "x")
    saved = {"command": "python benchmarks/made.py", **where, "tables": tables}
    (tmp_path / "made.json").write_text(json.dumps(saved), encoding="utf-8")
    monkeypatch.setattr(figures, "FIGURES", tmp_path)
    return figures


def test_cells_tables_and_outputs_are_inserted_and_the_source_once(made):
    text = made.rewritten(PAGE)
    assert "| step | median [ms] -->0.4<!-- --> ms." in text
    assert text.count("| step | 0.4 |") == 2
    assert "```text\nall done\n```" in text
    first, second, output = text.split(made.END)[:3]
    assert ["benchmarks/made.py" in part for part in (first, second, output)] == [False, True, True]
    assert made.rewritten(text) == text


def test_rows_of_an_earlier_run_are_named(made):
    path = made.FIGURES / "made.json"
    saved = json.loads(path.read_text(encoding="utf-8"))
    where = dict.fromkeys(("date", "machine", "load", "python", "versions"), "y")
    step = {"rows": ["step"], "command": "python benchmarks/made.py --rows step", **where}
    others = {"rows": ["stop", "go"], "command": "python benchmarks/made.py", **where, "date": "z"}
    older = {**others, "rows": ["stay"], "versions": "v"}
    earlier = {"times": [step, others, older]}
    path.write_text(json.dumps({**saved, "earlier": earlier}), encoding="utf-8")
    text = made.rewritten(PAGE)
    of_step = "step: `python benchmarks/made.py --rows step`, y, load y"
    of_others = "`python benchmarks/made.py`, z, load y"
    assert text.count(f"*Earlier, on y; Python y, y: {of_step}. stop; go: {of_others}.*") == 2
    assert text.count(f"*Earlier, on y; Python y, v: stay: {of_others}.*") == 2
    assert made.rewritten(text) == text


def test_what_is_not_saved_keeps_what_the_page_holds(made):
    held = PAGE.replace("made/", "other/").replace("<!-- end", "| 1 |\n<!-- end", 1)
    text = made.rewritten(held)
    assert made.unsaved(held) == {"other/times", "other/output"}
    assert "median [ms] -->9<!-- --> ms." in text
    assert "-->\n| 1 |\n<!-- end" in text
    assert text.count("make benchmark-save") == 2
    assert made.rewritten(text) == text


@pytest.mark.parametrize("wrong", ["step | mean [ms]", "stop | median [ms]"])
def test_a_cell_that_was_not_saved_is_an_error(made, wrong):
    with pytest.raises(KeyError):
        made.rewritten(PAGE.replace("step | median [ms]", wrong))


def test_typed_figures_are_found_outside_blocks_only(made):
    page = made.rewritten(PAGE) + "\nA step takes 0.4 ms at 3 m/s, with 2 % slip.\n"
    last = len(page.splitlines())
    assert made.typed_figures(page) == [(last, "0.4 ms"), (last, "2 %")]
    assert made.typed_figures("It weighs 3 kg, is 5 m long and waits for `0.5 s`.") == []


GIVEN = yaml.safe_load((Path(__file__).parent / "given_figures.yaml").read_text(encoding="utf-8"))
"""By page, figures that are typed because they were not measured, each with the reason."""


def test_no_measured_figure_is_typed(figures):
    # scripts/gallery.py writes the gallery, and a test compares the two.
    pages = {page.relative_to(CHECKOUT).as_posix(): page for page in figures.pages()}
    del pages["docs/gallery.md"]
    typed = {name: figures.typed_figures(page.read_text("utf-8")) for name, page in pages.items()}
    unknown = [
        f"{name}, line {line}: {figure}"
        for name, found in typed.items()
        for line, figure in found
        if figure not in GIVEN.get(name, {})
    ]
    assert unknown == [], "save it with a benchmark, or give the reason in given_figures.yaml"
    stale = {
        (name, figure)
        for name, given in GIVEN.items()
        for figure in given
        if figure not in {figure for _, figure in typed[name]}
    }
    assert not stale
