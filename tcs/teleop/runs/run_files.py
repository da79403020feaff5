"""Run files: CSV, one row per sample.

The columns of joint positions have the names of the joints, in radians, so that
`tcs capability record RUN.csv` makes a capability map of a run file.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tcs.errors import DataFileError, OutputError
from tcs.files.reading import read_bytes
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.teleop.runs.run import ARRAYS, IntArray, Run

if TYPE_CHECKING:
    import pandas as pd

SUFFIX = ".csv"
MAX_BYTES = 1024**3
"""Most bytes of a run file: some hours at 100 samples a second."""
VERSION = 2
"""Version of the columns and of the keys of the metadata."""
_VERSION_KEY = "run_format"
_XYZ = ("x", "y", "z")
_WXYZ = ("qw", "qx", "qy", "qz")
_METADATA = "metadata"
_INTEGERS = ("group", "sign", "limits")
_BOOLEANS = ("clutch", "singular", "stopped")


def save_run(path: Path, run: Run) -> None:
    """Write a run, completely or not at all.

    Raises:
        OutputError: If the file cannot be written, or its suffix is not that of a run.
    """
    check_suffix(path)
    # Ten digits: 1e-9 rad and 1e-10 m, far below any encoder, at half the size.
    content = _to_frame(run).to_csv(index=False, float_format="%.10g").encode()
    with whole_file(path, "Run") as stream:
        stream.write(content)


def check_suffix(path: Path) -> None:
    """Check the suffix of a path to write a run to.

    Raises:
        OutputError: If it is not that of a run.
    """
    if path.suffix != SUFFIX:
        raise OutputError(f"'{path}' ends in '{path.suffix}'; a run is {SUFFIX}.")


def load_run(path: Path) -> Run:
    """Return the run in a file that `save_run` wrote.

    Raises:
        DataFileError: If the file cannot be read, has another format version, is truncated, or
            contains an invalid sample.
    """
    where = f"run '{path}'"
    frame = _read(path, where)
    try:
        return _from_frame(frame)
    except DataFileError as error:
        # The messages start with "run": name the file there, on one line.
        text = " ".join(str(error).split())
        raise DataFileError(f"{where}{text.removeprefix('run')}") from None


def _read(path: Path, where: str) -> pd.DataFrame:
    """Return the table in a file.

    Raises:
        DataFileError: If the file cannot be read, or is not a table.
    """
    import pandas as pd

    if path.suffix != SUFFIX:
        raise DataFileError(f"{where} ends in '{path.suffix}'; must be {SUFFIX}.")
    content = read_bytes(path, where, DataFileError, limit=MAX_BYTES)
    try:
        frame = pd.read_csv(io.BytesIO(content), keep_default_na=False, low_memory=False)
    # pandas raises various exceptions on a broken file.
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DataFileError(f"{where} is not a table: {reason}.") from None
    # pandas pads a truncated row.
    last = content.rstrip(b"\r\n").rsplit(b"\n", 1)[-1]
    if len(frame) > 1 and last.count(b",") < len(frame.columns) - 1:
        raise DataFileError(
            f"{where}, sample {len(frame) - 1}: the row is cut short. Delete it, or record the run "
            "again."
        )
    return frame


def _to_frame(run: Run) -> pd.DataFrame:
    import pandas as pd

    columns: dict[str, Any] = {"time": run.time}
    columns |= _split(run.joint_names, run.joints)
    columns |= _split([f"{name}_rate" for name in run.joint_names], run.rates)
    columns |= _split(_XYZ, run.position) | _split(_WXYZ, run.quaternion)
    columns |= _split([f"linear_{axis}" for axis in _XYZ], run.linear)
    columns |= _split([f"angular_{axis}" for axis in _XYZ], run.angular)
    columns |= {"group": run.group, "sign": run.sign, "clutch": run.clutch.astype(int)}
    columns |= {"mode": run.mode.astype(object)}
    columns |= _split([f"{name}_limit" for name in run.joint_names], run.limits)
    columns |= {"singular": run.singular.astype(int), "stopped": run.stopped.astype(int)}
    # One cell, as readers of CSV have no common notation for comments.
    metadata = json.dumps({**run.metadata, _VERSION_KEY: VERSION}, sort_keys=True)
    columns[_METADATA] = [metadata] + [""] * (len(run) - 1)
    return pd.DataFrame(columns)


def _split(names: Sequence[str], table: FloatArray | IntArray) -> dict[str, Any]:
    return {name: table[:, i] for i, name in enumerate(names)}


def _from_frame(frame: pd.DataFrame) -> Run:
    """Return the run in a table.

    Raises:
        DataFileError: If a column is missing, or a value is invalid.
    """
    names = tuple(
        str(name).removesuffix("_rate") for name in frame.columns if str(name).endswith("_rate")
    )
    wide = {
        "joints": list(names),
        "rates": [f"{name}_rate" for name in names],
        "position": list(_XYZ),
        "quaternion": list(_WXYZ),
        "linear": [f"linear_{axis}" for axis in _XYZ],
        "angular": [f"angular_{axis}" for axis in _XYZ],
        "limits": [f"{name}_limit" for name in names],
    }
    columns = {name: wide.get(name, [name]) for name in ARRAYS}
    needed = [column for group in columns.values() for column in group] + [_METADATA]
    missing = [name for name in needed if name not in frame.columns]
    if missing or not names:
        listed = ", ".join(missing[:5]) or "JOINT_rate"
        raise DataFileError(
            f"run: column {listed} is missing. Give a file that `tcs teleop` saved."
        )
    metadata = _metadata(frame)
    arrays = {name: _values(frame, name, columns[name]) for name in ARRAYS}
    arrays |= {name: array[:, 0] for name, array in arrays.items() if name not in wide}
    return Run(names, **arrays, metadata=metadata)


def _metadata(frame: pd.DataFrame) -> dict[str, Any]:
    """Return the metadata, without the format version.

    Raises:
        DataFileError: If it is not a JSON object, or the file has another format version.
    """
    try:
        metadata = json.loads(str(frame[_METADATA].iloc[0])) if len(frame) else {}
    except (ValueError, RecursionError):
        metadata = None
    if not isinstance(metadata, dict):
        raise DataFileError("run: 'metadata' of the first sample is not a JSON object.")
    version = metadata.pop(_VERSION_KEY, 1)
    if version != VERSION and len(frame):
        raise DataFileError(
            f"run: it has format {version}; this version of tcs reads format {VERSION}. Record the "
            "run again."
        )
    return metadata


def _values(frame: pd.DataFrame, name: str, columns: list[str]) -> Any:
    """Return columns as an array, shape (n, columns).

    Raises:
        DataFileError: If a value does not fit the column.
    """
    import pandas as pd

    if name == "mode":
        return frame[columns].to_numpy().astype(str)
    values = np.column_stack(
        [pd.to_numeric(frame[column], errors="coerce").to_numpy(np.float64) for column in columns]
    )
    # `Run` checks for infinite and too large values.
    valid = ~np.isnan(values)
    required = "a number"
    if name in _INTEGERS:
        valid &= np.abs(values) < 1e9
        valid &= values == np.floor(values)
        required = "an integer"
    elif name in _BOOLEANS:
        valid &= (values == 0.0) | (values == 1.0)
        required = "0 or 1"
    if not valid.all():
        row, column = (int(i) for i in np.argwhere(~valid)[0])
        text = str(frame[columns[column]].iloc[row])[:40]
        raise DataFileError(
            f"run, sample {row}: '{columns[column]}' is '{text}'; must be {required}."
        )
    if name in _INTEGERS:
        return values.astype(np.int64)
    return values.astype(np.bool_) if name in _BOOLEANS else values
