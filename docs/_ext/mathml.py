"""Equations as MathML, which browsers set by themselves: no script, no font, no internet."""

from __future__ import annotations

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator


def visit_inline(page: HTML5Translator, node: nodes.math) -> None:
    """Write an equation within a line."""
    page.body.append(convert(node.astext()))
    raise nodes.SkipNode


def visit_block(page: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation of its own line, with its number and the anchor of its label."""
    anchor = f' id="{node["ids"][0]}"' if node["ids"] else ""
    page.body.append(f'<div class="equation"{anchor}>{convert(node.astext(), display="block")}')
    if node["number"]:
        page.body.append(f'<span class="eqno">({get_node_equation_number(page, node)})</span>')
    page.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer of equations."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
