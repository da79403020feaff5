"""Pages of the API, written from the tree: a page names its package, and every module is described.

A fence such as

    ```{package} tcs.model.grid
    ```

becomes the package's docstring with the names it exports, then one section for each module below
it with the names that no package above exports. A package below it with a page of its own is left
to that page. Modules may thus be added, renamed and moved without touching the pages.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError

CHECKOUT = Path(__file__).resolve().parents[2]
PLACES = {"tcs_shapes": "shapes", "tcs_studies": "studies"}
"""Folders of the packages that are not at the top of the checkout."""
FENCE = re.compile(r"^```\{package\} (tcs[.\w]*)\n```$", flags=re.M)


def folder_of(package: str) -> Path:
    """Return the folder of a package."""
    top, *parts = package.split(".")
    return CHECKOUT.joinpath(PLACES.get(top, ""), top, *parts)


def modules_below(package: str) -> list[str]:
    """Return the dotted names of a package's modules and packages; empty when it does not exist."""
    folder = folder_of(package)
    if not (folder / "__init__.py").is_file():
        return []
    names = [path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")]
    names += [path.parent.name for path in folder.glob("*/__init__.py")]
    return [f"{package}.{name}" for name in sorted(names)]


def sections(package: str, pages: set[str], described: set[int]) -> Iterator[str]:
    """Yield the Markdown of a package and of all below it.

    Args:
        package: Its dotted name.
        pages: Packages with pages of their own.
        described: Identities of the objects that the packages above export.
    """
    here = importlib.import_module(package)
    names = list(getattr(here, "__all__", []))
    options = ["imported-members"] if names else ["no-members"]
    yield automodule(package, options, omitted(here, names, described))
    described = described | {id(getattr(here, name)) for name in names}
    for name in modules_below(package):
        if name in pages:
            continue
        yield f"## {name.removeprefix('tcs.')}\n"
        if modules_below(name):
            yield from sections(name, pages, described)
            continue
        module = importlib.import_module(name)
        left_out = omitted(module, list(vars(module)), described)
        # Only one of a function and the module it is named after can be the target of links.
        if name.rpartition(".")[2] in names:
            yield automodule(name, ["no-members", "no-index"], [], members(module, left_out))
        else:
            yield automodule(name, [], left_out)


def omitted(module: ModuleType, names: list[str], described: set[int]) -> list[str]:
    """Return the names of a module's classes and functions that are described already."""
    return [
        name
        for name in names
        # `getattr`: a package may load its names on first use.
        if is_code(getattr(module, name)) and id(getattr(module, name)) in described
    ]


def is_code(value: object) -> bool:
    """Return whether an object has a home of its own: equal numbers and texts may be one object."""
    return inspect.isclass(value) or callable(value)


def members(module: ModuleType, left_out: list[str]) -> list[str]:
    """Return the directives that describe a module's own classes and functions one by one."""
    return [
        f".. auto{'class' if inspect.isclass(value) else 'function'}:: {module.__name__}::{name}"
        for name, value in vars(module).items()
        if getattr(value, "__module__", "") == module.__name__ and is_code(value)
        if not name.startswith("_") and name not in left_out
    ]


def automodule(
    module: str, options: list[str], left_out: list[str], others: list[str] | None = None
) -> str:
    """Return the Markdown that describes one module, followed by other directives."""
    lines = [f".. automodule:: {module}", *(f"   :{option}:" for option in options)]
    if left_out:
        lines.append(f"   :exclude-members: {', '.join(left_out)}")
    for directive in others or []:
        lines += ["", directive]
    return "\n".join(["```{eval-rst}", *lines, "```", ""])


def write_out(app: Sphinx, document: str, source: list[str]) -> None:
    """Replace the fences of a page by the descriptions of their packages."""
    pages = own_pages(app.env)

    def written(fence: re.Match[str]) -> str:
        package = fence[1]
        if not (folder_of(package) / "__init__.py").is_file():
            raise ExtensionError(f"{document}: there is no package {package}; rename the page")
        return "\n".join(sections(package, pages - {package}, set()))

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
