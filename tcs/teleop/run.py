"""A run: what the operator commanded and what the arm did, sample by sample, and its file.

A run's CSV file has a row of names and a row per sample. The arm's joints stand in columns of their
own names, in radians, so that `tcs capability record RUN.csv` makes a map of it as it is.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, OutputError
from tcs.files.writing import whole_file
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.settings import Mode

if TYPE_CHECKING:
    import pandas as pd

IntArray = NDArray[np.int64]
FORMATS = (".csv", ".parquet")
NO_GROUP = -1
"""Stands where no joint group was asked for."""
_UNIT_SLACK = 1e-6
"""How far from 1 a quaternion read from a file may be long: ten digits are written."""
_FARTHEST = 1000.0
"""A joint farther from zero than this [rad], 160 turns, is a broken file's."""
_XYZ = ("x", "y", "z")
_WXYZ = ("qw", "qx", "qy", "qz")
_METADATA = "metadata"


@dataclass(frozen=True, eq=False)
class Run:
    """A run of n samples; poses are those of the tool in the arm's frame of reference."""

    joint_names: tuple[str, ...]
    time: FloatArray
    """From the start of the run [s], shape (n,), rising."""
    joints: FloatArray
    """[rad], shape (n, 7)."""
    rates: FloatArray
    """[rad/s], shape (n, 7)."""
    position: FloatArray
    """[m], shape (n, 3)."""
    quaternion: FloatArray
    """Of length 1, wxyz, shape (n, 4)."""
    linear: FloatArray
    """Commanded velocity of the tool [m/s], shape (n, 3)."""
    angular: FloatArray
    """Commanded angular velocity of the tool [rad/s], shape (n, 3)."""
    group: IntArray
    """Commanded joint group, counted from 0, shape (n,); `NO_GROUP` for none."""
    sign: IntArray
    """The way it was to turn: -1, 0 or 1, shape (n,)."""
    clutch: BoolArray
    """Whether the clutch was pressed, which parts arm and hand, shape (n,)."""
    mode: NDArray[np.str_]
    """Name of the control mode, shape (n,)."""
    limits: IntArray
    """-1 where a joint was at its lower limit, 1 at its upper one, else 0, shape (n, 7)."""
    singular: BoolArray
    """Whether the arm was next to a singularity, shape (n,)."""
    stopped: BoolArray
    """Whether the arm refused to move on, shape (n,)."""
    metadata: Mapping[str, Any] = field(default_factory=dict)
    """Robot, condition, seed and whatever else tells where it is from: plain containers."""

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only.

        Raises:
            DataFileError: If the arrays do not belong together, a number is not finite, a mode is
                not known, a joint is turned beyond reason, the time does not rise, or a quaternion
                is not of length 1.
        """
        n, m = len(self.time), len(self.joint_names)
        wide = {"joints": m, "rates": m, "limits": m, "quaternion": 4}
        wide |= dict.fromkeys(("position", "linear", "angular"), 3)
        if n < 2:
            raise DataFileError(f"a run of {n} samples; it takes two at least.")
        for name in _ARRAYS:
            array = getattr(self, name)
            expected = (n, wide[name]) if name in wide else (n,)
            if array.shape != expected:
                raise DataFileError(
                    f"run: '{name}' has shape {array.shape}; with {n} times and {m} joints it must "
                    f"be {expected}."
                )
            if array.dtype.kind == "f" and not np.isfinite(array).all():
                row = int(np.argmax(~np.isfinite(array.reshape(n, -1)).all(axis=1)))
                raise DataFileError(f"run, sample {row}: '{name}' is not finite.")
            array.flags.writeable = False
        known = set(Mode)
        for row, mode in enumerate(self.mode):
            if mode not in known:
                raise DataFileError(
                    f"run, sample {row}: mode '{mode}' is none of {', '.join(Mode)}."
                )
        far = np.abs(self.joints) > _FARTHEST
        if far.any():
            row = int(np.argmax(far.any(axis=1)))
            raise DataFileError(
                f"run, sample {row}: a joint at {np.abs(self.joints[row]).max():g} rad; must be "
                f"within {_FARTHEST:g}."
            )
        if np.any(np.diff(self.time) <= 0.0):
            row = int(np.argmax(np.diff(self.time) <= 0.0)) + 1
            raise DataFileError(f"run, sample {row}: the time {self.time[row]:g} s does not rise.")
        if np.any(np.abs(np.linalg.norm(self.quaternion, axis=1) - 1.0) > _UNIT_SLACK):
            raise DataFileError("run: the tool's quaternions (qw, qx, qy, qz) must have length 1.")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def step(self) -> float:
        """Mean time from one sample to the next [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self) - 1)

    def hand(self) -> tuple[FloatArray, FloatArray]:
        """Return where the hand went while it was coupled to the tool.

        Commanded velocities are summed up from the origin; while the hand is not coupled it counts
        as at rest, as the paper reads effort off the controlled path only.

        Returns:
            Positions [m], shape (n, 3), and roll, pitch, yaw [rad], shape (n, 3), in the frame of
            the tool's poses.
        """
        from scipy.spatial.transform import Rotation

        moving = (~self.clutch & (self.group == NO_GROUP))[:, None]
        dt = np.diff(self.time, prepend=self.time[0])[:, None]
        position = np.cumsum(np.where(moving, self.linear, 0.0) * dt, axis=0)
        turns = Rotation.from_rotvec(np.where(moving, self.angular, 0.0) * dt).as_matrix()
        R = np.empty_like(turns)
        current = np.eye(3)
        for i, turn in enumerate(turns):
            current = R[i] = turn @ current
        angles = Rotation.from_matrix(R).as_euler("xyz", suppress_warnings=True)
        return position, angles


_ARRAYS = tuple(one.name for one in fields(Run) if one.name not in ("joint_names", _METADATA))


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
    single = [name for name in _ARRAYS if name not in wide]
    needed = [name for part in wide.values() for name in part] + [*single, _METADATA]
    missing = [name for name in needed if name not in frame.columns]
    if missing or not names:
        listed = ", ".join(missing[:5]) or "JOINT_rate"
        raise DataFileError(f"column {listed} is missing. Give a file that `tcs teleop` saved.")
    kinds = {"group": int, "sign": int, "limits": int, "mode": str}
    kinds |= dict.fromkeys(("clutch", "singular", "stopped"), bool)
    arrays: dict[str, Any] = {}
    for name in _ARRAYS:
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
