"""Joblib files of tcs: writing, and the header that names format and version."""

from __future__ import annotations

import io
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import joblib

from tcs.errors import StoreFormatError
from tcs.files.writing import whole_file


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
