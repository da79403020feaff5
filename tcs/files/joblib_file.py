"""Joblib files of tcs: writing, and the header that names format and version."""

from __future__ import annotations

import io
import os
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import joblib

from tcs.errors import StoreFormatError
from tcs.files.compression import check_claims
from tcs.files.reader import explained, read_joblib
from tcs.files.writing import whole_file

Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class JoblibFormat:
    """A file format: a joblib file of plain containers under a header."""

    what: str
    """Name of such a file in messages, e.g. "Capability map"."""
    name: str
    """Name of the format in the header, e.g. "tcs capability map"."""
    version: int
    """Version that this program writes and reads."""
    again: str
    """Advice in messages on how to make such a file."""

    def save(self, path: str | os.PathLike[str], content: Mapping[str, Any]) -> None:
        """Write a file; an interrupted write leaves none.

        Args:
            path: File to write; its folder must exist.
            content: Content without the header; large arrays should be compressed already.

        Raises:
            OutputError: If the file cannot be written.
        """
        write_joblib(Path(path), {**header(self.name, self.version), **content}, self.what)

    def load(
        self, path: str | os.PathLike[str], decode: Callable[[dict[str, Any]], Value]
    ) -> Value:
        """Read a file; the content is validated and never executed.

        Args:
            path: The file.
            decode: Returns the value of a content whose header and array sizes were checked.

        Raises:
            StoreError: If the file cannot be read.
            StoreFormatError: If the file is truncated, of another format or version, or `decode`
                raises an error.
            UnsafeStoreError: If it names an object outside the store's allow-list.
        """
        path = Path(path)
        content = read_joblib(path, self.what, self.again)
        return explained(path, lambda: decode(self._checked(content)), self.what, self.again)

    def _checked(self, content: object) -> dict[str, Any]:
        checked = check_header(content, self.name, self.version)
        check_claims(checked)
        return checked


def write_joblib(path: Path, content: Mapping[str, Any], what: str) -> None:
    """Write plain containers and arrays, completely or not at all; `read_joblib` reads them.

    Args:
        path: File to write; its folder must exist.
        content: Content of the file; large arrays should be compressed already.
        what: Name of the file in messages, e.g. "Score file".

    Raises:
        OutputError: If the file cannot be written.
    """
    buffer = io.BytesIO()
    joblib.dump(content, buffer)
    # Level 0 adds a checksum of the content without compressing it a second time.
    checked = zlib.compress(buffer.getbuffer(), 0)
    with whole_file(path, what) as stream:
        stream.write(checked)


def header(name: str, version: int) -> dict[str, Any]:
    """Return the entries that name a format and its version."""
    return {"format": name, "format_version": version}


def check_header(content: object, name: str, version: int) -> dict[str, Any]:
    """Return the content of a file of this format and version.

    Args:
        content: The content of a joblib file.
        name: Name of the format, e.g. "tcs scores".
        version: Version of the format that this program reads.

    Raises:
        StoreFormatError: If the file is of another format or version.
    """
    if not isinstance(content, dict) or content.get("format") != name:
        raise StoreFormatError(f"contains no {name.removeprefix('tcs ')} of tcs")
    found = content.get("format_version")
    if type(found) is not int or found < 1:
        raise StoreFormatError("has no format version")
    if found != version:
        age = "a newer" if found > version else "an older"
        advice = ": update tcs" if found > version else ""
        raise StoreFormatError(
            f"has format version {found}, written by {age} tcs, and this program reads version "
            f"{version}{advice}"
        )
    return content


def check_types(content: Mapping[str, Any], types: Mapping[str, type]) -> None:
    """Check that entries exist and have exactly the given types.

    Raises:
        StoreFormatError: If an entry is missing or of another type.
    """
    for name, expected in types.items():
        if type(content.get(name)) is not expected:
            raise StoreFormatError(f"lacks a valid '{name}' ({expected.__name__})")
