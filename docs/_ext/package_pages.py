"""Pages of the API, written from the tree: a page names its package, and every module is described.

A fence such as

    ```{package} tcs.model.grid
    ```

becomes the package's docstring with the names it exports, then one section for each module below
it with the names that the package does not export. A package below it with a page of its own is
left to that page. Modules may thus be added, renamed and moved without touching the pages.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError

PACKAGE = Path(__file__).resolve().parents[2] / "tcs"
FENCE = re.compile(r"^```\{package\} (tcs[.\w]*)\n```$", flags=re.M)


def modules_below(package: str) -> list[str]:
    """Return the dotted names of a package's modules and packages; empty when it does not exist."""
    folder = PACKAGE.joinpath(*package.split(".")[1:])
    if not (folder / "__init__.py").is_file():
        return []
    names = [path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")]
    names += [path.parent.name for path in folder.glob("*/__init__.py")]
    return [f"{package}.{name}" for name in sorted(names)]


def description(module: str, options: str) -> str:
    """Return the Markdown that describes one module."""
    return f"```{{eval-rst}}\n.. automodule:: {module}\n{options}```\n"


def members_of(module: str, left_out: list[str]) -> str:
    """Return the Markdown of a module whose own name is that of a function its package exports.

    Only one of the two can be the target of links: the function.
    """
    found = vars(importlib.import_module(module)).items()
    lines = [
        f".. auto{'class' if inspect.isclass(value) else 'function'}:: {module}::{name}"
        for name, value in found
        if getattr(value, "__module__", "") == module and not name.startswith("_")
        if name not in left_out and (inspect.isclass(value) or inspect.isroutine(value))
    ]
    members = "".join(f"\n{line}\n" for line in lines)
    return (
        f"```{{eval-rst}}\n.. automodule:: {module}\n   :no-members:\n   :no-index:\n{members}```\n"
    )


def exported(package: str) -> list[str]:
    """Return the names that a package exports."""
    return list(getattr(importlib.import_module(package), "__all__", []))


def sections(package: str, pages: set[str]) -> Iterator[str]:
    """Yield the Markdown of a package and of what is below it."""
    names = exported(package)
    yield description(package, "   :imported-members:\n" if names else "   :no-members:\n")
    left_out = f"   :exclude-members: {', '.join(names)}\n" if names else ""
    for module in modules_below(package):
        if module in pages:
            continue
        yield f"## {module.removeprefix('tcs.')}\n"
        if modules_below(module):
            yield from sections(module, pages)
        elif module.rpartition(".")[2] in names:
            yield members_of(module, names)
        else:
            yield description(module, left_out)


def write_out(app: Sphinx, document: str, source: list[str]) -> None:
    """Replace the fences of a page by the descriptions of their packages."""
    pages = own_pages(app.env)

    def written(fence: re.Match[str]) -> str:
        package = fence[1]
        if not (PACKAGE.joinpath(*package.split(".")[1:]) / "__init__.py").is_file():
            raise ExtensionError(f"{document}: there is no package {package}; rename the page")
        return "\n".join(sections(package, pages - {package}))

    source[0] = FENCE.sub(written, source[0])


def own_pages(env: BuildEnvironment) -> set[str]:
    """Return the packages that have a page of their own."""
    texts = (env.doc2path(name).read_text(encoding="utf-8") for name in env.found_docs)
    return {package for text in texts for package in FENCE.findall(text)}


def pages_of_packages(
    app: Sphinx, env: BuildEnvironment, added: set[str], changed: set[str], removed: set[str]
) -> list[str]:
    """Return the pages with a fence: a new module changes them without changing their source."""
    return [
        name
        for name in env.found_docs
        if FENCE.search(env.doc2path(name).read_text(encoding="utf-8"))
    ]


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to the events of reading a page."""
    app.connect("env-get-outdated", pages_of_packages)
    app.connect("source-read", write_out)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
