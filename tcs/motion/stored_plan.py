"""Plans read back from the JSON that `tcs plan` writes, without trusting it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import StoreFormatError, TcsError, one_line
from tcs.files.reading import read_text
from tcs.kernel.arrays import FloatArray
from tcs.kernel.freedom.forms import FEWEST_JOINTS
from tcs.model.grid import InitialConfiguration
from tcs.motion.curves import CHAIN
from tcs.motion.motion_plan import INTERPOLATION, GoalResult, MotionPlan, Segment, StopPlan
from tcs.motion.timing import Timed

MAX_BYTES = 256 * 1024**2
"""Greatest size of a plan [bytes]; that of a task takes some hundred kilobytes."""
_MOST = 1e9
"""Greatest absolute number of a plan: accelerations of larger ones would overflow."""
_LEAST_STEP = 1e-12
"""Least step of the times of a segment [s], likewise."""
_FAULTS = (
    *(KeyError, TypeError, ValueError, AttributeError),
    *(OverflowError, RecursionError, TcsError),
)
"""What reading something else than a plan raises."""
SEGMENT_TYPES = ("move", "approach", "retreat")
_BASE = ("base_x", "base_y", "base_yaw_deg", "torso")
_STOP = (*_BASE, "hand", "joints", "configuration", "goals", "returns", "duration", "segments")


def load_plan(path: str | os.PathLike[str]) -> MotionPlan:
    """Read a plan that was written as JSON.

    Args:
        path: The file.

    Raises:
        StoreFormatError: If it cannot be read or is no plan.
    """
    path = Path(path)
    where = f"Plan '{path}'"
    text = read_text(path, where, StoreFormatError, limit=MAX_BYTES)
    try:
        return _plan(json.loads(text))
    except _FAULTS as error:
        fault = f"lacks {error}" if isinstance(error, KeyError) else one_line(str(error), 160)
        raise StoreFormatError(
            f"{where} is not a plan of tcs ({fault}). Make it with: tcs plan FILE --out plan.json"
        ) from None


def _plan(plain: Mapping[str, Any]) -> MotionPlan:
    joints = tuple(str(name) for name in plain["joints"])
    made_from = plain["made_from"]
    if not isinstance(made_from, dict) or not FEWEST_JOINTS <= len(joints) <= CHAIN:
        raise ValueError("'made_from' must be a mapping and 'joints' five to seven names")
    # Plans were without it at first.
    if plain.get("interpolation", INTERPOLATION) != INTERPOLATION:
        raise ValueError(f"'interpolation' must be '{INTERPOLATION}'")
    verified = plain["verified"]
    return MotionPlan(
        made_from=made_from,
        joints=joints,
        stops=tuple(_stop(stop, len(joints)) for stop in plain["stops"]),
        results=tuple(_result(result) for result in plain["results"]),
        edges=_integer(verified["edges"]),
        false=_integer(verified["false"]),
        seed=_integer(plain["seed"]),
        seconds=_number(plain["seconds"]),
        jerk_limits=_jerk_limits(plain.get("jerk_limits"), len(joints)),
    )


def _jerk_limits(plain: Any, joints: int) -> tuple[float, ...] | None:
    if plain is None:
        return None
    limits = tuple(math.inf if limit is None else _number(limit) for limit in plain)
    if len(limits) != joints or min(limits) <= 0.0:
        raise ValueError("'jerk_limits' must be null or a number above 0, or null, for each joint")
    return limits


def _stop(plain: Mapping[str, Any], joints: int) -> StopPlan:
    axes = [name for name in plain if name not in _STOP]
    angles = [name.endswith("_deg") for name in axes]
    values = [_number(plain[name]) for name in axes]
    at = InitialConfiguration(
        base_x=_number(plain["base_x"]),
        base_y=_number(plain["base_y"]),
        base_yaw=math.radians(_number(plain["base_yaw_deg"])),
        torso=_number(plain["torso"]),
        environment=tuple(
            (name.removesuffix("_deg"), math.radians(value) if angle else value)
            for name, value, angle in zip(axes, values, angles, strict=True)
        ),
        environment_units=tuple("rad" if angle else "m" for angle in angles),
    )
    return StopPlan(
        at=at,
        index=None if plain["configuration"] is None else _integer(plain["configuration"]),
        segments=tuple(_segment(segment, joints) for segment in plain["segments"]),
        returns=bool(plain["returns"]),
        hand=str(plain.get("hand", "")),
        joints=tuple(str(name) for name in plain.get("joints", ())),
    )


def _segment(plain: Mapping[str, Any], joints: int) -> Segment:
    if plain["type"] not in SEGMENT_TYPES:
        raise ValueError(f"'type' must be one of {', '.join(SEGMENT_TYPES)}")
    times = _array(plain["times"], 1)
    positions, velocities = _array(plain["positions"], 2), _array(plain["velocities"], 2)
    shape = (len(times), joints)
    if len(times) < 2 or positions.shape != shape or velocities.shape != shape:
        raise ValueError(
            "a segment must have positions and velocities of all joints for each of its times"
        )
    if times[0] != 0.0 or not np.all(np.diff(times) >= _LEAST_STEP):
        raise ValueError("the times of a segment must ascend from 0")
    start, end = (None if plain[key] == "rest" else _integer(plain[key]) for key in ("from", "to"))
    return Segment(plain["type"], start, end, Timed(times, positions, velocities))


def _result(plain: Mapping[str, Any]) -> GoalResult:
    pair = plain.get("pair")
    return GoalResult(
        goal=_integer(plain["goal"]),
        stop=None if plain["stop"] is None else _integer(plain["stop"]),
        done=bool(plain["done"]),
        reason=str(plain.get("reason", "")),
        pair=None if pair is None else (str(pair[0]), str(pair[1])),
        segment=str(plain.get("segment", "")),
        seconds=_number(plain.get("seconds", 0.0)),
    )


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("numbers must be finite")
    return float(value)


def _integer(value: Any) -> int:
    number = _number(value)
    if not number.is_integer():
        raise ValueError("goals, stops, counts and seeds must be whole numbers")
    return int(value)


def _array(value: Any, dimensions: int) -> FloatArray:
    array = np.array(value, dtype=np.float64)
    if array.ndim != dimensions or not np.all(np.isfinite(array)):
        raise ValueError("numbers must be finite, in lists of equal length")
    if np.any(np.abs(array) > _MOST):
        raise ValueError(f"numbers must be at most {_MOST:g}")
    return array
