"""Docstrings as they are written here, made ready for Napoleon."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx


def make_ready(
    app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]
) -> None:
    """Keep colons of attributes, bars and asterisks from being taken for markup.

    Napoleon takes the text before the first colon of an attribute's first line for its type.
    Attributes here have their types in annotations, and colons in their sentences: an empty comment
    goes first. A bar opens a substitution for Sphinx, an asterisk an emphasis; in these docstrings
    they are absolute values and products or file patterns.
    """
    lines[:] = [
        line if "`" in line or ">>>" in line else re.sub(r"\||\*(?=\S)", r"\\\g<0>", line)
        for line in lines
    ]
    if what in ("attribute", "data", "property") and lines:
        lines[:0] = ["..", ""]


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect before Napoleon, whose priority is 500."""
    app.connect("autodoc-process-docstring", make_ready, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
