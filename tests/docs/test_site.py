"""The site builds without a warning, opens offline, and leads from equations to functions."""

import importlib
import re
from pathlib import Path
from types import FunctionType

import pytest

import tcs
from tests.docs.building import CHECKOUT, DOCS, build

# No room of their own that others import from: the command line, and single modules.
WITHOUT_PAGE = {"cli"}


def pages(site: Path) -> list[Path]:
    return [path for path in site.rglob("*.html") if "_modules" not in path.parts]


def test_every_page_of_the_docs_is_there(site):
    for source in DOCS.rglob("*.md"):
        assert (site / source.relative_to(DOCS)).with_suffix(".html").is_file()


def test_pages_load_nothing_from_elsewhere(site):
    assert len(pages(site)) > 20
    for path in [*site.rglob("*.html"), *site.rglob("*.css")]:
        text = path.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe|source)[^>]* src=[\"']([^\"']+)", text)
        loaded += re.findall(
            r"<link (?![^>]*rel=\"(?:index|search|next|prev)\")[^>]*href=\"([^\"]+)", text
        )
        loaded += re.findall(r"(?:@import|url\()\s*[\"']?((?:https?:)?//[^\"')]+)", text)
        assert [target for target in loaded if re.match(r"(https?:)?//", target)] == [], path


def test_equations_are_set(site):
    text = (site / "method.html").read_text(encoding="utf-8")
    assert text.count("<math ") >= 6
    assert "$$" not in re.sub(r"<pre>.*?</pre>", "", text, flags=re.S)
    # What the converter does not know stays as it was written, with its backslash.
    equations = re.findall(r"<math .*?</math>", text, flags=re.S)
    assert [equation for equation in equations if "\\" in equation or "&#x0005C;" in equation] == []


@pytest.mark.parametrize(
    "target",
    [
        "tables.html#tcs.placement.tables.tc_reachability",
        "kernel.html#tcs.kernel.measure.isotropy_at",
        "kernel.html#tcs.kernel.analytic.lanes.solve_lanes",
        "kernel.html#tcs.kernel.analytic.pairs.score_pair",
        "tables.html#tcs.placement.tables.tc_manipulability",
        "select.html#tcs.placement.selection.utility",
        "select.html#tcs.placement.selection.shortest_tour",
        "select.html#tcs.placement.selection.select",
        "kernel.html#tcs.kernel.measure.limit_penalty",
    ],
)
def test_equation_leads_to_its_function(site, target):
    assert f'href="api/{target}"' in (site / "method.html").read_text(encoding="utf-8")
    page, anchor = target.split("#")
    assert f'id="{anchor}"' in (site / "api" / page).read_text(encoding="utf-8")


def test_every_promised_name_leads_to_its_description(site):
    text = (site / "api" / "tcs.html").read_text(encoding="utf-8")
    for name in sorted(set(tcs.__all__) - {"__version__"}):
        assert re.search(
            rf'<a class="reference internal" href="[^"]+" title="[^"]+">'
            rf'<code[^>]*><span class="pre">tcs\.{name}</span>',
            text,
        ), name


def rooms() -> list[str]:
    found = {path.parent.name for path in (CHECKOUT / "tcs").glob("*/__init__.py")}
    return sorted(found - WITHOUT_PAGE)


@pytest.mark.parametrize("room", rooms())
def test_every_name_of_a_room_is_described(site, room):
    text = (site / "api" / f"{room}.html").read_text(encoding="utf-8")
    there = vars(importlib.import_module(f"tcs.{room}"))
    # Constants and names of types have no home of their own that Sphinx could find.
    kinds = (type, FunctionType)
    names = [name for name in there.get("__all__", []) if isinstance(there[name], kinds)]
    assert [name for name in names if f'id="tcs.{room}.{name}"' not in text] == []


def test_links_that_lead_nowhere_fail_the_build(tmp_path):
    wrong = {
        "`tcs.errors.TcsEror`": "target not found: tcs.errors.TcsEror",
        "`tcs.placement.store.lode(path)`": "target not found: tcs.placement.store.lode",
        "[the method](method.md)": "target not found: 'method.md'",
        "[here](#nowhere)": "target not found: 'nowhere'",
        "![a map](images/no.png)": "image file not readable: images/no.png",
    }
    (tmp_path / "docs").mkdir()
    page = "# A page\n\n" + "\n\n".join(wrong) + "\n"
    (tmp_path / "docs" / "index.md").write_text(page, encoding="utf-8")
    done = build(tmp_path / "docs", tmp_path / "out")
    assert done.returncode != 0
    assert [complaint for complaint in wrong.values() if complaint not in done.stderr] == []
