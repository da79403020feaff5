"""How Sphinx makes the site; `make docs` runs it, every warning an error, without the internet."""

from __future__ import annotations

import os
import sys
from pathlib import Path

# Their models cannot be made once autodoc has loaded pydantic again, to read types for checkers.
import fastapi  # noqa: F401
import mcp  # noqa: F401

HERE = Path(__file__).resolve().parent
# The kernel's functions as plain Python: with signatures to read, and nothing to compile.
os.environ["NUMBA_DISABLE_JIT"] = "1"
sys.path[:0] = [
    str(HERE / "_ext"),
    str(HERE.parent),
    str(HERE.parent / "shapes"),
    str(HERE.parent / "studies"),
]

project = "tcs"
author = "The tcs authors"
project_copyright = "the tcs authors, BSD 3-Clause License"

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "code_links",
    "docstrings",
    "mathml",
    "menu",
    "package_pages",
]
exclude_patterns = ["_ext", "_static"]
# Single backticks in docstrings are code, as in Markdown.
default_role = "code"

myst_enable_extensions = ["dollarmath", "colon_fence"]
# Headings of pages that are linked to by anchor get the anchors that GitHub gives them.
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_class_signature = "separated"
# Every page carries the whole menu: with each function in it, it would be long and slow to make.
toc_object_entries = False
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
# "Returns" as plain text: Napoleon takes what stands before a colon in it for a type.
napoleon_custom_sections = ["Returns", "Source"]
python_use_unqualified_type_names = True

nitpicky = True
# Types in signatures lead to their description where there is one; foreign and inner ones have
# none. All other links have to lead somewhere.
nitpick_ignore_regex = [("py:class", ".*")]

html_theme = "furo"
html_title = "tcs"
html_static_path = ["_static"]
html_css_files = ["tcs.css"]
html_copy_source = False
html_show_sphinx = False
