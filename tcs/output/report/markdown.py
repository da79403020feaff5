"""A page as Markdown: its text and tables."""

from __future__ import annotations

from functools import singledispatch

from tcs.output.report.blocks import (
    Block,
    Bullets,
    Code,
    Collapsible,
    Facts,
    Page,
    Picture,
    Table,
    Text,
)


def as_markdown(page: Page) -> str:
    """Return a page as Markdown; pictures are reduced to their captions."""
    parts = [f"# {_plain(page.title)}", _plain(page.lead)]
    for section in page.sections:
        parts += [f"## {_plain(section.title)}", *(_written(block) for block in section.blocks)]
    if page.foot:
        parts.append(_plain(page.foot))
    return "\n\n".join(part for part in parts if part) + "\n"


@singledispatch
def _written(block: Block) -> str:
    raise TypeError(f"a page has no block of type {type(block).__name__}.")


@_written.register
def _(block: Text) -> str:
    return _plain(block.text)


@_written.register
def _(block: Bullets) -> str:
    return "\n".join(f"- {_plain(item)}" for item in block.items)


@_written.register
def _(block: Code) -> str:
    return f"```sh\n{block.text}\n```"


@_written.register
def _(block: Facts) -> str:
    return "\n".join(f"- {_plain(name)}: {_plain(value)}" for name, value in block.items)


@_written.register
def _(block: Table) -> str:
    titles = [_plain(column.title) for column in block.columns]
    rule = ["---:" if column.is_number else "---" for column in block.columns]
    rows = [[_plain(text) for text in row] for row in block.texts()]
    lines = ["| " + " | ".join(row) + " |" for row in (titles, rule, *rows)]
    return f"{_plain(block.caption)}\n\n" + "\n".join(lines)


@_written.register
def _(block: Picture) -> str:
    return f"*{_plain(block.caption)}*"


@_written.register
def _(block: Collapsible) -> str:
    return f"**{_plain(block.title)}**\n\n" + "\n\n".join(_written(b) for b in block.blocks)


def _plain(text: str) -> str:
    """Return text with the special characters of Markdown escaped."""
    for sign in ("\\", "|", "*", "_", "`", "<"):
        text = text.replace(sign, f"\\{sign}")
    return " ".join(text.splitlines())
