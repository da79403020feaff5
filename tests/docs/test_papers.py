"""The page of the three papers lists every number of the print, and names only what exists."""

import re
import sys
from pathlib import Path

import pytest
import typer.main

from tcs.cli.app import app
from tests.docs.test_commands import options_of

CHECKOUT = Path(__file__).resolve().parents[2]
DOCS = CHECKOUT / "docs"
PAGE = (DOCS / "papers.md").read_text(encoding="utf-8")
sys.path.insert(0, str(DOCS / "_ext"))
from code_links import object_named  # noqa: E402


def numbered(noun: str, first: int, last: int, prefix: str = "") -> list[str]:
    return [f"{noun} {prefix}{number}" for number in range(first, last + 1)]


def equations(first: int, last: int, prefix: str = "") -> list[str]:
    return [f"eq. ({prefix}{number})" for number in range(first, last + 1)]


def appendices(*names: str) -> list[str]:
    """Return appendices and their sections: "B 2 1.3" is B, B.1, B.2 and B.1.1 to B.1.3."""
    found = []
    for name in names:
        letter, *counts = name.split()
        found.append(f"Appendix {letter}")
        for count in counts:
            section, _, subsections = count.rpartition(".")
            where = f"Appendix {letter}.{section}." if section else f"Appendix {letter}."
            found += [f"{where}{i}" for i in range(1, int(subsections) + 1)]
    return found


# Numbers of the print, by heading of the page.
PRINT = {
    "TCS": [
        *("I II III IV V VI".split()),
        *("III-A III-A.1 III-A.2 III-A.3 III-A.4 III-A.5 III-B IV-A IV-A.1 IV-A.2 V-A".split()),
        *equations(1, 5),
        *numbered("Figure", 1, 6),
        *(f"Table {number}" for number in ("I", "II", "III")),
    ],
    "ITCM thesis": [
        *("I II III IV V VI II.A II.B II.C II.D II.E III.A III.B III.C IV.A IV.B V.A".split()),
        *(f"III.C.{i}" for i in range(1, 6)),
        *("IV.B.1", "IV.B.2"),
        *appendices("A 3", "B 3 1.3", "C 4 2.4", "D 5 3.6", "E", "F 4", *"GHIJ"),
        *equations(1, 30),
        *numbered("Figure", 1, 62),
        *numbered("Table", 1, 9),
        "Listing 1",
    ],
    "Null-space paper": [
        *("I II III IV V I.A I.B II.A II.B II.C IV.A IV.B".split()),
        *(f"III.{letter}" for letter in "ABCDE"),
        *(f"II.B.{i}" for i in range(1, 4)),
        *(f"II.C.{i}" for i in range(1, 8)),
        *appendices("A 3", "B 2", "C 1", "D 2"),
        *equations(1, 16),
        *equations(1, 2, "A."),
        *numbered("Figure", 1, 11),
        *numbered("Figure", 1, 9, "A."),
        *numbered("Figure", 1, 2, "B."),
        *numbered("Figure", 1, 2, "C."),
        "Figure D.1",
        *(f"Table {number}" for number in ("I", "II", "III", "IV", "B.1")),
        "Experiment information form",
        "Van der Laan questionnaire",
    ],
}


def table(heading: str) -> list[list[str]]:
    """Return the rows of the first table below a heading."""
    text = PAGE[PAGE.index(f"\n## {heading}\n") :]
    lines = text[text.index("| number |") :].splitlines()[2:]
    end = next((i for i, line in enumerate(lines) if not line.startswith("|")), len(lines))
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines[:end]]


def single(label: str) -> list[str]:
    """Return the numbers of a label: "Figures A.1 to A.7" has seven."""
    match = re.fullmatch(r"Figures ([A-Z]\.)(\d+) to \1(\d+)", label)
    return numbered("Figure", int(match[2]), int(match[3]), match[1]) if match else [label]


@pytest.mark.parametrize("heading", PRINT)
def test_every_number_of_the_print_is_listed_once(heading):
    listed = [number for row in table(heading) for number in single(row[0])]
    assert sorted(listed) == sorted(PRINT[heading])


@pytest.mark.parametrize("heading", PRINT)
def test_every_row_says_where_or_why_not(heading):
    for row in table(heading):
        assert len(row) == 3, row
        assert all(row), row
        # A place, another number of the print, or a reason.
        place = r"`|\]\(|^eq\. \(|^Appendix|not here: |not yet: |^the URDF"
        assert re.search(place, row[2]), row


def code_spans() -> list[str]:
    return sorted(set(re.findall(r"`([^`\n]+)`", PAGE)))


def test_every_name_exists():
    named = [span for span in code_spans() if re.fullmatch(r"tcs(\.\w+)+", span)]
    assert len(named) > 50
    assert [name for name in named if object_named(name) is None] == []


def test_every_command_and_option_exists():
    root = typer.main.get_command(app)
    lines = [span for span in code_spans() if re.match(r"tcs [a-z]", span)]
    assert len(lines) > 10
    for line in lines:
        command, words = root, line.split()[1:]
        while words and hasattr(command, "commands") and not words[0].startswith("-"):
            command = command.commands[words.pop(0)]
        unknown = {word for word in words if word.startswith("--")} - options_of(command)
        assert not unknown, line
    alone = {span.split()[0] for span in code_spans() if span.startswith("--")}
    assert alone <= options_of(root)


def test_every_file_exists():
    named = [span for span in code_spans() if re.match(r"(tasks|models|scripts|benchmarks)/", span)]
    assert len(named) >= 5
    assert [path for path in named if not (CHECKOUT / path).exists()] == []


def slug(heading: str) -> str:
    """Return the anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def test_every_linked_section_exists():
    links = re.findall(r"\]\(([\w-]+\.md)?(?:#([\w-]+))?\)", PAGE)
    assert len(links) > 30
    for name, anchor in links:
        page = DOCS / (name or "papers.md")
        text = page.read_text(encoding="utf-8")
        anchors = map(slug, re.findall(r"^#+ (.+)$", text, flags=re.M))
        assert not anchor or anchor in anchors, (name, anchor)
