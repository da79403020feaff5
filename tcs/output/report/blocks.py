"""What a page is made of: sections of text, lists, tables and pictures, as plain values.

Nothing here knows HTML: `tcs.output.report.html` and `tcs.output.report.markdown` write a page.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Tone = Literal["plain", "good", "bad", "quiet"]
"""How a cell is to be read at a glance; its text must say the same without colour."""


@dataclass(frozen=True, slots=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True, slots=True)
class Bullets:
    """A list."""

    items: Sequence[str]


@dataclass(frozen=True, slots=True)
class Code:
    """Lines to type."""

    text: str


@dataclass(frozen=True, slots=True)
class Facts:
    """Names and what they stand for."""

    items: Sequence[tuple[str, str]]


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table with a tone."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    title: str
    is_number: bool = True
    """Numbers stand to the right."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table; every row has as many cells as there are columns."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell | str]]

    def __post_init__(self) -> None:
        """Check the shape."""
        # A mistake of ours, never of a user.
        assert all(len(row) == len(self.columns) for row in self.rows), self.caption

    def texts(self) -> list[list[str]]:
        """Return the cells without their tones."""
        return [[cell if isinstance(cell, str) else cell.text for cell in row] for row in self.rows]


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture within the page."""

    content: bytes
    """The file: SVG or PNG."""
    format: Literal["svg", "png"]
    description: str
    """What is to be seen, for who cannot see it."""
    caption: str


@dataclass(frozen=True, slots=True)
class Folded:
    """Blocks that are shown when their title is pressed; on paper they are shown."""

    title: str
    blocks: Sequence[Block]


Block = Text | Bullets | Code | Facts | Table | Picture | Folded


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page with a heading."""

    title: str
    blocks: Sequence[Block]

    @property
    def anchor(self) -> str:
        """What a link to it ends in.

        >>> Section("Table I: 13 rows", ()).anchor
        'table-i-13-rows'
        """
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True, slots=True)
class Page:
    """A whole page."""

    title: str
    lead: str
    """What it is, in a sentence or two."""
    sections: Sequence[Section]
    foot: str = ""
    """Version, date, machine: what stands below everything."""
