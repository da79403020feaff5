"""The site builds without a warning, opens offline, and leads from equations to functions."""

import importlib
import re
from pathlib import Path
from types import FunctionType

import pytest

import tcs
from tcs.kernel.analytic.samples import measure_samples
from tcs.kernel.analytic.score_pair import score_pair
from tcs.kernel.dexterity.measures import isotropy_at, limit_penalty
from tcs.placement.selection import select, shortest_tour, utility
from tcs.placement.tables import tc_manipulability, tc_reachability
from tests.docs.building import CHECKOUT, DOCS, build

# Building takes more than a minute; CI runs this file by itself.
pytestmark = pytest.mark.slow

# The command line has pages of its own, and no names that others import.
WITHOUT_PAGE = {("cli",), ("__main__",)}


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
    # Commands that the converter does not support keep their backslash.
    equations = re.findall(r"<math .*?</math>", text, flags=re.S)
    assert [equation for equation in equations if "\\" in equation or "&#x0005C;" in equation] == []


EQUATIONS = [
    isotropy_at,
    limit_penalty,
    measure_samples,
    score_pair,
    select,
    shortest_tour,
    tc_manipulability,
    tc_reachability,
    utility,
]


@pytest.mark.parametrize("function", EQUATIONS, ids=lambda function: function.__name__)
def test_equation_leads_to_its_function(site, function):
    text = (site / "method.html").read_text(encoding="utf-8")
    links = re.findall(rf'href="(api/[^"#]+)#(tcs[.\w]*\.{function.__name__})"', text)
    assert links
    for page, anchor in links:
        assert f'id="{anchor}"' in (site / page).read_text(encoding="utf-8")


def test_every_promised_name_leads_to_its_description(site):
    text = (site / "api" / "tcs.html").read_text(encoding="utf-8")
    for name in sorted(set(tcs.__all__) - {"__version__"}):
        assert re.search(
            rf'<a class="reference internal" href="[^"]+" title="[^"]+">'
            rf'<code[^>]*><span class="pre">tcs\.{name}</span>',
            text,
        ), name


def modules() -> list[str]:
    """Return the modules and packages whose description belongs in the API."""
    tops = {"tcs": "", "tcs_shapes": "shapes", "tcs_studies": "studies"}
    paths = [
        path.relative_to(CHECKOUT / top)
        for name, top in tops.items()
        for path in (CHECKOUT / top / name).rglob("*.py")
    ]
    names = [path.parent if path.stem == "__init__" else path.with_suffix("") for path in paths]
    return sorted(".".join(name.parts) for name in names if name.parts[1:2] not in WITHOUT_PAGE)


def test_every_module_is_described(site):
    text = "".join(path.read_text(encoding="utf-8") for path in (site / "api").rglob("*.html"))
    described = set(re.findall(r'id="module-(tcs[.\w]*)"', text))
    # A function that a package exports hides the module it is named after.
    functions = set(re.findall(r'id="(tcs[.\w]+)"', text))
    assert [name for name in modules() if name not in described | functions] == []


def homes(package: str, name: str) -> set[str]:
    """Return where an exported name may be described: a package above may export it too."""
    parts = package.split(".")
    return {".".join([*parts[:size], name]) for size in range(2, len(parts) + 1)}


def test_every_exported_name_is_described(site):
    text = "".join(path.read_text(encoding="utf-8") for path in (site / "api").rglob("*.html"))
    described = set(re.findall(r'id="(tcs[.\w]+)"', text))
    missing = []
    for module in set(modules()) - {"tcs"}:
        if not hasattr(importlib.import_module(module), "__path__"):
            continue
        there = importlib.import_module(module)
        exported = {n: getattr(there, n) for n in getattr(there, "__all__", [])}
        # Sphinx does not describe constants and type aliases separately.
        names = [n for n, value in exported.items() if isinstance(value, (type, FunctionType))]
        missing += [f"{module}.{n}" for n in names if described.isdisjoint(homes(module, n))]
    assert missing == []


def test_page_of_a_package_that_does_not_exist_fails_the_build(tmp_path):
    (tmp_path / "docs").mkdir()
    page = "# A page\n\n```{package} tcs.nothing\n```\n"
    (tmp_path / "docs" / "index.md").write_text(page, encoding="utf-8")
    done = build(tmp_path / "docs", tmp_path / "out")
    assert done.returncode != 0
    assert "index: there is no package tcs.nothing; rename the page" in done.stderr


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
