"""Pages as HTML and as Markdown."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from importlib.resources import files

import pytest

from tcs.output.report import Page, Section, as_html, as_markdown
from tcs.output.report.blocks import (
    Bullets,
    Cell,
    Code,
    Collapsible,
    Column,
    Facts,
    Picture,
    Table,
    Text,
)

PNG = b"\x89PNG not really"
SVG = b"""<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0"/></svg>"""
HOSTILE = "<script>alert('x')</script> & \"quotes\" | `code` *stars*"
EMPTY = {"br", "img", "meta", "link", "path"}


class Reader(HTMLParser):
    """Checks that tags are closed in order, and collects their text."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.links, self.text = [], [], [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for key, value in attributes if key in ("src", "href", "xlink:href")]
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in EMPTY:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def read(page):
    reader = Reader()
    reader.feed(as_html(page))
    assert reader.open == []
    return reader


def column(table, title):
    """The texts of one column."""
    titles = [column.title for column in table.columns]
    return [row[titles.index(title)] for row in table.texts()]


def page_of(*blocks):
    return Page("A title", "The lead.", [Section("One: first", blocks), Section("Two", [])], "foot")


@pytest.fixture
def everything():
    """A page with a block of every type, all of them hostile."""
    table = Table(HOSTILE, [Column(HOSTILE, is_number=False), Column("n")], [[HOSTILE, "1"]])
    return page_of(
        Text(HOSTILE),
        Bullets([HOSTILE, "b"]),
        Code(HOSTILE),
        Facts([(HOSTILE, HOSTILE)]),
        table,
        Picture(PNG, "png", HOSTILE, HOSTILE),
        Picture(SVG, "svg", HOSTILE, "drawn"),
        Collapsible(HOSTILE, [Text("within"), table]),
    )


def test_all_text_is_escaped(everything):
    reader = read(everything)
    assert "script" not in reader.tags
    assert "".join(reader.text).count(HOSTILE) == 13


def test_the_page_needs_nothing_else(everything):
    reader = read(everything)
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in reader.links)
    assert "default-src 'none'" in as_html(everything)
    assert reader.tags.count("svg") == 1
    assert "<?xml" not in as_html(everything)


def test_links_at_the_top_lead_to_sections(everything):
    html = as_html(everything)
    for link in re.findall(r'href="#([^"]*)"', html):
        assert f'id="{link}"' in html
    assert html.count('href="#') == 2


def test_tones_are_classes_beside_the_words():
    table = Table("t", [Column("x")], [[Cell("-3.6", "bad")], ["0.0"]])
    html = as_html(page_of(table))
    assert '<td class="number bad">-3.6</td>' in html
    assert '<td class="number">0.0</td>' in html


@pytest.mark.parametrize("write", [as_html, as_markdown])
def test_an_unknown_block_is_named(write):
    with pytest.raises(TypeError, match=r"a page has no block of type float"):
        write(page_of(1.5))


def test_rows_have_as_many_cells_as_columns():
    with pytest.raises(AssertionError):
        Table("t", [Column("a"), Column("b")], [["1"]])


def test_markdown_has_every_table_and_no_sign_that_means_something(everything):
    text = as_markdown(everything)
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    # Two tables of a head, a rule and a row; a bar that is text is not a border.
    assert len(rows) == 6
    assert all(len(re.findall(r"(?<!\\)\|", row)) == 3 for row in rows)
    assert re.search(r"(?<!\\)<script", text.replace("```sh\n" + HOSTILE, "")) is None
    assert text.startswith("# A title\n\nThe lead.\n\n## One: first\n")


def test_what_can_be_scrolled_is_reached_with_the_keyboard(everything):
    html = as_html(everything)
    assert html.count("<pre") == html.count('<pre tabindex="0">') == 1
    assert html.count('class="scroll"') == html.count('class="scroll" tabindex="0"') == 2


def contrast(one, other):
    """Contrast of two colours #rrggbb, WCAG 2.2."""

    def luminance(colour):
        parts = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_contrast_on_every_ground(scheme):
    style = files("tcs.output.report").joinpath("page.css").read_text(encoding="utf-8")
    light, dark = style.split("@media screen and (prefers-color-scheme: dark)")
    part = light if scheme == "light" else dark
    colour = dict(re.findall(r"--(ink|quiet|blue|band): (#[0-9a-f]{6})", part))
    tones = re.findall(r"td\.(?:good|bad) \{ color: (#[0-9a-f]{6})", part)
    assert len(tones) == 2
    ground = {"light": "#ffffff", "dark": "#15191d"}[scheme]
    assert f"background: {ground.replace('#ffffff', '#fff')}" in part
    for text in (colour["ink"], colour["quiet"], colour["blue"], *tones):
        assert min(contrast(text, on) for on in (ground, colour["band"])) >= 4.5
