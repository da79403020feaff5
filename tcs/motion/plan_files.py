"""Plans as files: JSON, CSV with a row for each sample, ROS 1 and 2 messages, arrays for Drake.

JSON is as `tcs plan --json` prints it. The others hold the trajectory of each stop as a whole.
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import OutputError
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.motion.motion_plan import MotionPlan

FORMATS = (".json", ".csv", ".yaml", ".ros1.yaml", ".npz")


def check_plan_path(path: Path) -> None:
    """Check that a plan can be written in the format of a path.

    Raises:
        OutputError: If its suffix is not one of `FORMATS`.
    """
    if _format(path) not in FORMATS:
        raise OutputError(
            f"Cannot write '{path}': a plan is written as "
            f"{', '.join(FORMATS[:-1])} or {FORMATS[-1]}."
        )


def save_plan(path: Path, plan: MotionPlan) -> None:
    """Write a plan in the format of its suffix: one of FORMATS.

    Raises:
        OutputError: If the format is unknown or the file cannot be written.
    """
    check_plan_path(path)
    written = {
        ".json": lambda: json.dumps(plan.to_json(), indent=1).encode(),
        ".csv": lambda: plan_csv(plan).encode(),
        ".yaml": lambda: plan_messages(plan).encode(),
        ".ros1.yaml": lambda: plan_messages(plan, ros=1).encode(),
        ".npz": lambda: plan_arrays(plan),
    }
    content = written[_format(path)]()
    with whole_file(path, "Plan") as stream:
        stream.write(content)


def _format(path: Path) -> str:
    """Return the one of FORMATS that a path ends in, else its suffix."""
    return ".ros1.yaml" if path.name.endswith(".ros1.yaml") else path.suffix


def plan_csv(plan: MotionPlan) -> str:
    """Return the samples of a plan as CSV.

    Columns: `stop` and `segment`, counted from 0; `type`; `from` and `to`, numbers of goals or
    "rest"; `time` since the begin of the stop's tour [s]; the position of each joint [rad]; its
    velocity [rad/s] under its name with the suffix `_velocity`. Joints of an arm that is parked
    meanwhile are empty.
    """
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    names = tuple(dict.fromkeys(name for stop in plan.stops for name in plan.joints_of(stop)))
    names = names or plan.joints
    velocities = [f"{name}_velocity" for name in names]
    rows.writerow(["stop", "segment", "type", "from", "to", "time", *names, *velocities])
    for number, stop in enumerate(plan.stops):
        begin = 0.0
        columns = [names.index(name) for name in plan.joints_of(stop)]
        for index, segment in enumerate(stop.segments):
            ends = ["rest" if end is None else end for end in (segment.start, segment.end)]
            head = [number, index, segment.type, *ends]
            timing = segment.timing
            samples = zip(timing.times, timing.positions, timing.velocities, strict=True)
            for at, q, v in samples:
                cells: list[object] = [""] * (2 * len(names))
                for column, position, rate in zip(columns, q.tolist(), v.tolist(), strict=True):
                    cells[column], cells[len(names) + column] = position, rate
                rows.writerow([*head, f"{begin + at:.9f}", *cells])
            begin += timing.duration
    return out.getvalue()


def plan_messages(plan: MotionPlan, *, ros: int = 2) -> str:
    """Return the trajectory of each stop in the layout of ROS `trajectory_msgs/JointTrajectory`.

    One YAML document for each stop with motions. Points have no accelerations: controllers follow
    cubics, the plan's curve, through positions and velocities, but quintics where accelerations are
    given too, and those of a plan jump.

    Args:
        plan: The plan.
        ros: Version of ROS, 1 or 2, which name the parts of a time differently.
    """
    begin = {"stamp": _time(0.0, ros), "frame_id": ""}
    documents = []
    for stop in plan.stops:
        if not stop.segments:
            continue
        found = stop.samples()
        rows = zip(found.times, found.positions, found.velocities, strict=True)
        message = {
            "header": {"seq": 0, **begin} if ros == 1 else begin,
            "joint_names": list(plan.joints_of(stop)),
            "points": [{**_point(q, v), "time_from_start": _time(t, ros)} for t, q, v in rows],
        }
        # JSON is YAML, and much faster to write.
        documents.append(json.dumps(message))
    return "".join(f"---\n{document}\n" for document in documents)


def _point(q: FloatArray, v: FloatArray) -> dict[str, Any]:
    return {
        "positions": q.tolist(),
        "velocities": v.tolist(),
        "accelerations": [],
        "effort": [],
    }


def _time(seconds: float, ros: int) -> dict[str, int]:
    names = ("secs", "nsecs") if ros == 1 else ("sec", "nanosec")
    return dict(zip(names, divmod(round(float(seconds) * 1e9), 10**9), strict=True))


def plan_arrays(plan: MotionPlan) -> bytes:
    """Return the trajectory of each stop as arrays in numpy's format.

    `joints`; for stop number N with motions `breaks_N` [s], shape (n,), `samples_N` [rad] and
    `samples_dot_N` [rad/s], shapes (7, n), as `PiecewisePolynomial.CubicHermite` of Drake takes;
    in a plan of several hands `joints_N` as well.
    """
    arrays: dict[str, Any] = {"joints": np.array(plan.joints)}
    for number, stop in enumerate(plan.stops):
        if stop.segments:
            found = stop.samples()
            arrays[f"breaks_{number}"] = found.times
            if stop.joints:
                arrays[f"joints_{number}"] = np.array(stop.joints)
            arrays[f"samples_{number}"] = found.positions.T
            arrays[f"samples_dot_{number}"] = found.velocities.T
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()
