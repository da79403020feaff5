"""The parts of a page: sections of text, lists, tables and pictures, as plain values.

`tcs.output.report.html` and `tcs.output.report.markdown` write a page.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Tone = Literal["plain", "good", "bad", "quiet"]
"""Emphasis of a cell; its text must have the same meaning without colour."""


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
    """Command lines."""

    text: str


@dataclass(frozen=True, slots=True)
class Facts:
    """Names and their values."""

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
    """Whether the column is right-aligned."""


@dataclass(frozen=True, slots=True)
class Table:
    """A table; every row has as many cells as there are columns."""

    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell | str]]

    def __post_init__(self) -> None:
        """Check the shape."""
        # A violation is a defect of the program, not an error of the user.
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
    """Text alternative of the picture."""
    caption: str


@dataclass(frozen=True, slots=True)
class Collapsible:
    """Blocks that expand when their title is clicked, and are always printed."""

    title: str
    blocks: Sequence[Block]


Block = Text | Bullets | Code | Facts | Table | Picture | Collapsible


@dataclass(frozen=True, slots=True)
class Section:
    """A part of a page with a heading."""

    title: str
    blocks: Sequence[Block]

    @property
    def anchor(self) -> str:
        """The fragment of a link to it.

        >>> Section("Table I: 13 rows", ()).anchor
        'table-i-13-rows'
        """
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-")


@dataclass(frozen=True, slots=True)
class Page:
    """A whole page."""

    title: str
    lead: str
    """The subject of the page, in one or two sentences."""
    sections: Sequence[Section]
    foot: str = ""
    """Version and date, at the end of the page."""
