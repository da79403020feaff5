"""Run files: CSV or Parquet."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tcs.errors import DataFileError, OutputError
from tcs.files.writing import whole_file
from tcs.teleop.runs.run import ARRAYS, Run

if TYPE_CHECKING:
    import pandas as pd

FORMATS = (".csv", ".parquet")
_XYZ = ("x", "y", "z")
_WXYZ = ("qw", "qx", "qy", "qz")
_METADATA = "metadata"


def save_run(path: Path, run: Run) -> None:
    """Write a run, as CSV or as Parquet by the ending of its name; whole or not at all.

    CSV keeps ten digits, Parquet all of them.

    Raises:
        OutputError: If it cannot be written there, has another ending, or Parquet's library is not
            installed.
    """
    check_format(path)
    frame = _as_frame(run)
    if path.suffix == ".csv":
        # Ten digits: 1e-9 rad and 1e-10 m, far below any encoder, in half the room of all digits.
        content = frame.to_csv(index=False, float_format="%.10g").encode()
    else:
        buffer = io.BytesIO()
        frame.to_parquet(buffer, engine="pyarrow", index=False)
        content = buffer.getvalue()
    with whole_file(path, "Run") as stream:
        stream.write(content)


def check_format(path: Path) -> None:
    """Refuse a file that no run could be written to.

    Raises:
        OutputError: If its name ends otherwise, or Parquet's library is not installed.
    """
    if path.suffix not in FORMATS:
        raise OutputError(f"'{path}' ends in '{path.suffix}'; a run is {' or '.join(FORMATS)}.")
    if path.suffix == ".parquet" and not _has_parquet():
        raise OutputError(
            f"'{path}' needs a library that is not installed: pip install 'tcs[parquet]'. "
            "Or write .csv."
        )


def load_run(path: Path) -> Run:
    """Return the run in a file that `save_run` wrote.

    Raises:
        DataFileError: If it cannot be read, or is no run.
    """
    import pandas as pd

    where = f"run '{path}'"
    if path.suffix not in FORMATS:
        raise DataFileError(f"{where} ends in '{path.suffix}'; must be {' or '.join(FORMATS)}.")
    if path.suffix == ".parquet" and not _has_parquet():
        raise DataFileError(
            f"{where} needs a library that is not installed: pip install 'tcs[parquet]'."
        )
    try:
        if path.suffix == ".csv":
            frame = pd.read_csv(path, keep_default_na=False)
        else:
            frame = pd.read_parquet(path, engine="pyarrow")
    except OSError as error:
        raise DataFileError(f"{where} cannot be read: {error.strerror or error}.") from None
    # pandas and its engines raise what they like on a broken file.
    except Exception as error:
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DataFileError(f"{where} is no table: {said}.") from None
    try:
        return _from_frame(frame)
    except DataFileError as error:
        raise DataFileError(f"{where}: {error}") from None


def _has_parquet() -> bool:
    from importlib.util import find_spec

    return find_spec("pyarrow") is not None


def _as_frame(run: Run) -> pd.DataFrame:
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
    # One cell: a table has no other place for it that every reader of CSV passes over.
    columns[_METADATA] = [json.dumps(dict(run.metadata), sort_keys=True)] + [""] * (len(run) - 1)
    return pd.DataFrame(columns)


def _from_frame(frame: pd.DataFrame) -> Run:
    names = tuple(
        name.removesuffix("_rate") for name in frame.columns if str(name).endswith("_rate")
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
    single = [name for name in ARRAYS if name not in wide]
    needed = [name for part in wide.values() for name in part] + [*single, _METADATA]
    missing = [name for name in needed if name not in frame.columns]
    if missing or not names:
        listed = ", ".join(missing[:5]) or "JOINT_rate"
        raise DataFileError(f"column {listed} is missing. Give a file that `tcs teleop` saved.")
    kinds = {"group": int, "sign": int, "limits": int, "mode": str}
    kinds |= dict.fromkeys(("clutch", "singular", "stopped"), bool)
    arrays: dict[str, Any] = {}
    for name in ARRAYS:
        columns = wide.get(name, name)
        kind: Any = kinds.get(name, float)
        try:
            values = frame[columns].to_numpy()
            arrays[name] = values.astype(int).astype(bool) if kind is bool else values.astype(kind)
        except (ValueError, TypeError):
            raise DataFileError(f"'{name}' holds something that is no number.") from None
    try:
        metadata = json.loads(str(frame[_METADATA].iloc[0])) if len(frame) else {}
    except json.JSONDecodeError:
        raise DataFileError("'metadata' of the first sample is no JSON object.") from None
    if not isinstance(metadata, dict):
        raise DataFileError("'metadata' of the first sample is no JSON object.")
    return Run(names, **arrays, metadata=metadata)


def _split(names: Any, table: Any) -> dict[str, Any]:
    return {name: table[:, i] for i, name in enumerate(names)}
