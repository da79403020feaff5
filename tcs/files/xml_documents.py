"""XML documents: URDF and SDFormat files, read from a regular file and refused in one line."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
import xml.parsers.expat as expat
from pathlib import Path

from tcs.errors import TcsError
from tcs.files.reading import read_bytes

MAX_BYTES = 50 * 1024**2
"""Most bytes of an XML file: a hundred times the largest URDF of the packages in use."""

_UNBOUND = expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX]


def read_xml(path: Path, where: str, error: type[TcsError]) -> ElementTree.Element:
    """Return the root element of an XML file, in the encoding that it declares.

    Args:
        path: The file.
        where: Name of the file in messages, e.g. "URDF 'arm.urdf'".
        error: Class of the error to raise.

    Raises:
        TcsError: As `error`, if the file cannot be read, or is not XML in its encoding.
    """
    content = read_bytes(path, where, error, limit=MAX_BYTES)
    try:
        try:
            return ElementTree.fromstring(content)
        except ElementTree.ParseError as reason:
            if reason.code != _UNBOUND:
                raise
            return _without_namespaces(content)
    except ElementTree.ParseError as reason:
        raise error(f"{where} is not valid XML: {reason}.") from None
    except (ValueError, LookupError) as reason:
        raise error(f"{where} declares an encoding that cannot be read: {reason}.") from None


def _without_namespaces(content: bytes) -> ElementTree.Element:
    """Return the root element of a document whose prefixes, such as `drake:`, are not declared.

    The parsers of ROS and Drake know no namespaces, so such files exist.
    """
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(content, True)
    except expat.ExpatError as reason:
        raise ElementTree.ParseError(str(reason)) from None
    return builder.close()
