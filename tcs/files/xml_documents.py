"""XML documents: URDF and SDFormat files, read from a regular file and refused in one line."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from tcs.errors import TcsError
from tcs.files.reading import read_text

MAX_BYTES = 50 * 1024**2
"""Most bytes of an XML file: a hundred times the largest URDF of the packages in use."""


def read_xml(path: Path, where: str, error: type[TcsError]) -> ElementTree.Element:
    """Return the root element of an XML file in UTF-8.

    Args:
        path: The file.
        where: Name of the file in messages, e.g. "URDF 'arm.urdf'".
        error: Class of the error to raise.

    Raises:
        TcsError: As `error`, if the file cannot be read, or is not XML in UTF-8.
    """
    text = read_text(path, where, error, limit=MAX_BYTES)
    try:
        # Bytes, because a text with an encoding declaration is refused.
        return ElementTree.fromstring(text.encode())
    except ElementTree.ParseError as reason:
        raise error(f"{where} is not valid XML: {reason}.") from None
    except (ValueError, LookupError) as reason:
        raise error(f"{where} declares an encoding that cannot be read: {reason}.") from None
