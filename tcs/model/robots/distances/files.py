"""Files of tables of distances: an archive of arrays of numpy, without pickles."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import RobotError
from tcs.files.unchanged import kept_while_unchanged
from tcs.files.writing import whole_file
from tcs.model.robots.distances.table import DistanceTable

MOST_CORNERS = 1 << 24
"""Most corners of one table."""
_HEADER = "header"


def write_tables(path: Path, tables: Sequence[DistanceTable], source: str) -> None:
    """Write tables to a file.

    Args:
        path: The file, `.npz`.
        tables: The tables.
        source: Where the meshes are from, with their version, and how the tables were made.

    Raises:
        OutputError: If the file cannot be written.
    """
    described = [
        {"pair": t.pair, "joints": t.joints, "reach": t.reach, "source": t.source} for t in tables
    ]
    header = json.dumps({"source": source, "tables": described})
    arrays: dict[str, Any] = {f"corners_{n}": t.corners for n, t in enumerate(tables)}
    arrays[_HEADER] = np.frombuffer(header.encode(), np.uint8)
    with whole_file(path, "tables of distances") as stream:
        np.savez_compressed(stream, **arrays)


@kept_while_unchanged(files=16)
def read_tables(path: Path) -> tuple[DistanceTable, ...]:
    """Return the tables of a file.

    Raises:
        RobotError: If it is no such file, or damaged.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            header = json.loads(bytes(arrays[_HEADER]))
            return tuple(
                _table(fields, arrays[f"corners_{n}"]) for n, fields in enumerate(header["tables"])
            )
    except OSError as error:
        raise RobotError(f"tables of distances '{path}': {error}.") from error
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise RobotError(
            f"'{path}' is no file of distances, damaged, or of an earlier version. Restore or "
            "measure it again, or remove the field 'distances' of the robot file: shapes alone "
            "decide then."
        ) from error


def _table(fields: dict[str, Any], corners: Any) -> DistanceTable:
    """Return a table from its description and its corners.

    Raises:
        ValueError: If they are none.
    """
    if corners.dtype != np.uint8 or corners.ndim != 2 or not 0 < corners.size <= MOST_CORNERS:
        raise ValueError("corners")
    pair, joints, reach = (tuple(fields[name]) for name in ("pair", "joints", "reach"))
    # Of a reach below 0, or that is not a number, nothing follows.
    if not (len(pair) == len(joints) == len(reach) == 2 and all(r >= 0.0 for r in reach)):
        raise ValueError("fields")
    corners.flags.writeable = False
    return DistanceTable(
        pair=(str(pair[0]), str(pair[1])),
        joints=(str(joints[0]), str(joints[1])),
        reach=(float(reach[0]), float(reach[1])),
        corners=corners,
        source=str(fields["source"]),
    )
