"""One menu for all pages of source code that lie equally deep, as none of them stands in it.

The theme writes the whole menu on each page, which takes longer than all else of such a page.
"""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx


class Menus:
    """Menus of the pages of source code, made once for each depth."""

    def __init__(self) -> None:
        """Have none yet."""
        self._made: dict[tuple[int, tuple[tuple[str, Any], ...]], str] = {}

    def share(
        self, app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any
    ) -> None:
        """Give a page of source code the menu of another one at its depth."""
        if not page.startswith("_modules/"):
            return
        depth, made = page.count("/"), context["toctree"]

        def menu(**options: Any) -> str:
            # Links are relative, and no other page lies in that folder: only the depth matters.
            key = depth, tuple(sorted(options.items()))
            if key not in self._made:
                self._made[key] = made(**options)
            return self._made[key]

        context["toctree"] = menu


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect before the theme, whose priority is 500."""
    app.connect("html-page-context", Menus().share, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
