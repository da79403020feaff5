"""A page as one self-contained HTML document."""

from __future__ import annotations

import base64
import re
from functools import singledispatch
from html import escape
from importlib.resources import files

from tcs.output.report.blocks import (
    Block,
    Bullets,
    Cell,
    Code,
    Collapsible,
    Column,
    Facts,
    Page,
    Picture,
    Section,
    Table,
    Text,
)

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
"""Content security policy: the page loads and runs nothing, whatever text it contains."""


def as_html(page: Page) -> str:
    """Return a page as a whole HTML document: style and pictures within, no script."""
    style = files("tcs.output.report").joinpath("page.css").read_text(encoding="utf-8")
    links = "".join(
        f'<a href="#{section.anchor}">{escape(section.title)}</a>' for section in page.sections
    )
    foot = f"<footer><p>{escape(page.foot)}</p></footer>" if page.foot else ""
    return "\n".join(
        [
            "<!doctype html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
            f"<title>{escape(page.title)}</title>",
            f"<style>\n{style}</style>",
            "</head>",
            "<body>",
            "<main>",
            f"<h1>{escape(page.title)}</h1>",
            f'<p class="lead">{escape(page.lead)}</p>',
            f"<nav>{links}</nav>",
            *(_section(section) for section in page.sections),
            "</main>",
            foot,
            "</body>",
            "</html>",
            "",
        ]
    )


def _section(section: Section) -> str:
    body = "\n".join(_written(block) for block in section.blocks)
    return f'<section>\n<h2 id="{section.anchor}">{escape(section.title)}</h2>\n{body}\n</section>'


@singledispatch
def _written(block: Block) -> str:
    raise TypeError(f"a page has no block of type {type(block).__name__}.")


@_written.register
def _(block: Text) -> str:
    return f"<p>{escape(block.text)}</p>"


@_written.register
def _(block: Bullets) -> str:
    return "<ul>\n" + "\n".join(f"<li>{escape(item)}</li>" for item in block.items) + "\n</ul>"


@_written.register
def _(block: Code) -> str:
    # What can be scrolled must be reached with the keyboard.
    return f'<pre tabindex="0"><code>{escape(block.text)}</code></pre>'


@_written.register
def _(block: Facts) -> str:
    items = [f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in block.items]
    return "<dl>\n" + "\n".join(items) + "\n</dl>"


@_written.register
def _(block: Table) -> str:
    head = "".join(
        f'<th scope="col"{_number(column)}>{escape(column.title)}</th>' for column in block.columns
    )
    rows = [
        "<tr>" + "".join(_cell(*both) for both in zip(row, block.columns, strict=True)) + "</tr>"
        for row in block.rows
    ]
    # The caption stays in place when a wide table is scrolled on a phone.
    return (
        f'<figure class="table">\n<figcaption>{escape(block.caption)}</figcaption>\n'
        f'<div class="scroll" tabindex="0"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(rows)
        + "\n</tbody></table></div>\n</figure>"
    )


@_written.register
def _(block: Picture) -> str:
    description = escape(block.description)
    if block.format == "svg":
        # Start at the root element: an XML declaration is not allowed within HTML.
        drawing = block.content.decode("utf-8")
        drawing = drawing[drawing.index("<svg") :]
        drawing = re.sub(r"^<svg", f'<svg role="img" aria-label="{description}"', drawing)
    else:
        data = base64.b64encode(block.content).decode("ascii")
        drawing = f'<img alt="{description}" src="data:image/png;base64,{data}">'
    return f"<figure>\n{drawing}\n<figcaption>{escape(block.caption)}</figcaption>\n</figure>"


@_written.register
def _(block: Collapsible) -> str:
    inner = "\n".join(_written(inside) for inside in block.blocks)
    return f"<details>\n<summary>{escape(block.title)}</summary>\n{inner}\n</details>"


def _number(column: Column) -> str:
    return ' class="number"' if column.is_number else ""


def _cell(cell: Cell | str, column: Column) -> str:
    cell = Cell(cell) if isinstance(cell, str) else cell
    classes = ["number"] if column.is_number else []
    classes += [cell.tone] if cell.tone != "plain" else []
    shown = f' class="{" ".join(classes)}"' if classes else ""
    return f"<td{shown}>{escape(cell.text)}</td>"
