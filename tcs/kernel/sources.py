"""The sources that machine code is made of.

Numba copies into the machine code of a function all that it calls, the constants that it reads and
the layout of the named tuples that it is given. These are defined in the function's own module, in
those that it imports, and in those of the types of the arguments. What decides the code is
therefore the text of these modules and of all that they import in turn.

Imports are found in the text, wherever they stand: for type checkers only, or in a function. Too
many are found rather than too few, and a module that could import what its text does not name
counts as importing the whole package.
"""

from __future__ import annotations

import hashlib
import re
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import types

COMPILER = tuple(
    f"tcs.kernel.{name}" for name in ("cache", "inner_code", "machine_code", "sources")
)
"""Modules that compile and that no compiled function takes anything from. Their text decides all
machine code; what they import decides none of it."""

_FROM = re.compile(r"\bfrom\b\s*([.\w]+?)\s*\bimport\b(?=\s*(\((?:[^()#]|#.*)*|.*))")
_IMPORT = re.compile(r"(?:^|[;:])[ \t]*import\b([^\n;]*)", re.MULTILINE)
_ANYTHING = re.compile(r"\b(?:importlib|import_module|__import__|exec|eval|globals|modules)\b")
_COMMENT = re.compile(r"#.*")

_CLOCK = 0.02
"""By how much the time of an edit that a file system notes may be early [s]."""

_NO_SOURCES = {*sys.stdlib_module_names, "numba", "numpy", "llvmlite"}
"""Packages that are told by their versions."""


@dataclass(frozen=True)
class _Source:
    path: Path
    digest: bytes
    imports: frozenset[str]


class Sources:
    """The modules of one package, read when they are first asked for."""

    def __init__(self, folder: Path, since: float) -> None:
        """Take the package's folder.

        Args:
            folder: The folder; its name is the package's.
            since: When the first of the modules may have been imported, by `time.time`.
        """
        self._folder, self._since = folder, since
        self._read: dict[str, _Source] = {}
        self._paths: dict[str, Path | None] = {}
        self._digests: dict[frozenset[str], str | None] = {}

    def digest(self, modules: Iterable[str]) -> str | None:
        """Return a hash of the sources of modules and of all that they import.

        Args:
            modules: Names of modules, of the package or imported from elsewhere. Of the latter,
                only what they import from the package is followed.

        Returns:
            The hash as 32 hex digits; None if a source is missing or was edited since: what was
            imported may then be another text.
        """
        asked = frozenset(modules)
        if asked not in self._digests:
            try:
                self._digests[asked] = self._digest(self.closure(asked))
            except OSError:
                self._digests[asked] = None
        return self._digests[asked]

    def closure(self, modules: Iterable[str]) -> frozenset[str]:
        """Return the names of modules and of all that they import, the compiler's left out.

        Raises:
            OSError: If a source cannot be read.
        """
        found: set[str] = set(COMPILER)
        left = list(modules)
        while left:
            name = left.pop()
            if name not in found:
                found.add(name)
                left += self._source(name).imports
        return frozenset(found.difference(COMPILER))

    def _digest(self, names: frozenset[str]) -> str | None:
        hashed = hashlib.sha256()
        now = time.time()
        for name in sorted(names):
            source = self._read[name]
            status = source.path.stat()
            if self._since - _CLOCK <= max(status.st_mtime, status.st_ctime) <= now:
                return None
            hashed.update(name.encode() + b"\0" + source.digest)
        return hashed.hexdigest()[:32]

    def _source(self, name: str) -> _Source:
        if name not in self._read:
            path = self._path(name) or _path_elsewhere(name)
            text = path.read_bytes()
            found = frozenset(self._imports(name, path, text.decode(errors="replace")))
            self._read[name] = _Source(path, hashlib.sha256(text).digest(), found)
        return self._read[name]

    def _path(self, name: str) -> Path | None:
        """Return the file of a module of the package, None if it has no such module."""
        if name not in self._paths:
            package, *parts = name.split(".")
            plain = self._folder.joinpath(*parts)
            paths = plain / "__init__.py", plain.with_name(f"{plain.name}.py")
            here = package == self._folder.name
            self._paths[name] = next((p for p in paths if here and p.is_file()), None)
        return self._paths[name]

    def _imports(self, name: str, path: Path, text: str) -> Iterator[str]:
        """Yield the modules of the package that a module imports."""
        text = text.replace("\\\n", " ")
        package = self._folder.name
        within = re.compile(rf"\b{package}\b")
        if _ANYTHING.search(text) or any(
            within.search(names[1]) for names in _IMPORT.finditer(text)
        ):
            yield from self._below(package)
        for found in _FROM.finditer(text):
            module = found[1]
            if level := len(module) - len(module.lstrip(".")):
                parts = name.split(".")
                parts = parts[: len(parts) + (path.stem == "__init__") - level]
                module = ".".join((*parts, *filter(None, [module.lstrip(".")])))
            if (imported := self._path(module)) is None:
                continue
            yield module
            if imported.stem != "__init__":
                continue
            for part in _COMMENT.sub("", found[2]).strip("() \t\r\n").split(","):
                member = part.split(maxsplit=1)[0] if part.strip() else ""
                if member == "*":
                    yield from self._below(module)
                elif self._path(f"{module}.{member}") is not None:
                    yield from self._below(f"{module}.{member}")

    def _below(self, name: str) -> Iterator[str]:
        """Yield a module of the package and, if it is a package, all modules in it."""
        yield name
        path = self._path(name)
        if path is None or path.stem != "__init__":
            return
        for inside in path.parent.rglob("*.py"):
            if inside != path:
                parts = inside.relative_to(path.parent).with_suffix("").parts
                yield ".".join((name, *(part for part in parts if part != "__init__")))


def _path_elsewhere(name: str) -> Path:
    """Return the source of an imported module of another package.

    Raises:
        OSError: If it has none.
    """
    file = getattr(sys.modules.get(name), "__file__", None)
    if file is None:
        raise FileNotFoundError(f"module '{name}' has no source")
    return Path(file)


def homes(numba_type: Any) -> frozenset[str]:
    """Return the modules that define the classes and functions of which a numba type tells.

    Args:
        numba_type: The type, or a tuple of types.
    """
    return frozenset(
        module for module in _homes(numba_type) if module.split(".")[0] not in _NO_SOURCES
    )


def _homes(value: Any) -> Iterator[str]:
    if isinstance(value, types.Dispatcher):
        yield value.dispatcher.py_func.__module__
    elif isinstance(value, types.Type):
        yield from _homes_of_members(value)
    elif isinstance(value, type) or callable(value):
        yield getattr(value, "__module__", None) or "builtins"
    elif isinstance(value, dict):
        yield from _homes(tuple(value.values()))
    elif isinstance(value, (tuple, list, set, frozenset)):
        for member in value:
            yield from _homes(member)


@cache
def _homes_of_members(numba_type: Any) -> frozenset[str]:
    return frozenset((type(numba_type).__module__, *_homes(vars(numba_type))))


_PACKAGE = Path(__file__).parents[1]

SOURCES = Sources(_PACKAGE, sys.modules[_PACKAGE.name].loaded_at)
"""Those of this package."""
