"""Names of the package in code spans become links to the API, and wrong names fail the build.

A span such as `tcs.select`, `tcs.placement.tables.ScoreTable.reached` or `tcs.load("x.tcs")` reads
well wherever the Markdown is shown. On the site it leads to the object's description. The same
object may be named by its package or by its module; both lead to the one description there is.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Mapping
from typing import Any

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import find_pending_xref_condition, make_refnode

NAME = re.compile(r"(tcs(?:\.\w+)+)(?:\(.*\))?", flags=re.S)


def link_names(app: Sphinx, doctree: nodes.document) -> None:
    """Wrap each code span that is a name of the package, or a call of one, into a reference."""
    for span in list(doctree.findall(nodes.literal)):
        match = NAME.fullmatch(span.astext())
        if match is None or isinstance(span.parent, (pending_xref, nodes.reference)):
            continue
        link = pending_xref(
            "",
            refdomain="py",
            reftype="obj",
            reftarget=match[1],
            refexplicit=True,
            refwarn=True,
            refdoc=app.env.docname,
        )
        span.replace_self(link)
        link += span


def leave_foreign_types(app: Sphinx, doctree: nodes.document) -> None:
    """Unwrap references to types of other packages, which are described nowhere here.

    Sphinx would look for each of the thousands among all names that end alike.
    """
    for link in list(doctree.findall(pending_xref)):
        target = link.get("reftarget", "")
        if link.get("reftype") == "class" and target[:1].islower() and target[:4] != "tcs.":
            unresolved = find_pending_xref_condition(link, "*")
            link.replace_self((unresolved or link).children)


def object_named(name: str) -> Any:
    """Return the object of a dotted name, or None when there is none."""
    found: Any = None
    for size, part in enumerate(name.split("."), start=1):
        inner = getattr(found, part, None)
        if inner is None:
            # What a module is called may also be a function beside it, and that is what is meant.
            try:
                inner = importlib.import_module(".".join(name.split(".")[:size]))
            except ImportError:
                return None
        found = inner
    return found


class Descriptions:
    """Where each object of the package is described, under whichever of its names."""

    def __init__(self) -> None:
        """Know nothing yet: the descriptions have to be read first."""
        self._names: dict[int, str] = {}

    def collect(self, app: Sphinx, env: BuildEnvironment) -> None:
        """Learn under which name each object is described."""
        names = env.domains["py"].objects
        found = {
            name: object_named(name)
            for name, entry in names.items()
            if name.startswith("tcs") and not entry.aliased
        }
        # Equal numbers and texts may be one object; what is called or opened is not.
        self._names = {
            id(value): name
            for name, value in found.items()
            if callable(value) or inspect.ismodule(value)
        }

    def name_of(self, target: str, objects: Mapping[str, Any]) -> str | None:
        """Return the name under which `target` is described, or None when it is not."""
        if "." not in target:
            target = f"tcs.errors.{target}"
        if target in objects or not target.startswith(("tcs.", "tcs_")):
            return target if target in objects else None
        name = self._names.get(id(object_named(target)))
        if name is None:
            # Fields of a dataclass are looked for in its description.
            owner, _, field = target.rpartition(".")
            name = f"{self._names.get(id(object_named(owner)))}.{field}"
        return name if name in objects else None

    def resolve(
        self, app: Sphinx, env: BuildEnvironment, node: pending_xref, content: nodes.TextElement
    ) -> nodes.reference | None:
        """Return a link to what a reference names by another name than its description does."""
        if node.get("refdomain") != "py":
            return None
        objects = env.domains["py"].objects
        name = self.name_of(node["reftarget"], objects)
        if name is None:
            return None
        entry = objects[name]
        return make_refnode(
            app.builder, node["refdoc"], entry.docname, entry.node_id, content, name
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to the events of reading and resolving."""
    descriptions = Descriptions()
    app.connect("doctree-read", link_names)
    app.connect("doctree-read", leave_foreign_types)
    app.connect("env-check-consistency", descriptions.collect)
    app.connect("missing-reference", descriptions.resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
