"""Plans as files: JSON as `tcs plan --json` prints it, or CSV with one row for each sample."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

from tcs.errors import OutputError
from tcs.files.writing import whole_file
from tcs.motion.motion_plan import MotionPlan

FORMATS = (".json", ".csv")


def check_plan_path(path: Path) -> None:
    """Check that a plan can be written in the format of a path.

    Raises:
        OutputError: If its suffix is not one of `FORMATS`.
    """
    if path.suffix not in FORMATS:
        raise OutputError(f"Cannot write '{path}': a plan is written as {' or '.join(FORMATS)}.")


def save_plan(path: Path, plan: MotionPlan) -> None:
    """Write a plan as JSON or CSV, by the suffix of the path.

    Raises:
        OutputError: If the format is unknown or the file cannot be written.
    """
    check_plan_path(path)
    text = json.dumps(plan.to_json(), indent=1) if path.suffix == ".json" else plan_csv(plan)
    with whole_file(path, "Plan") as stream:
        stream.write(text.encode())


def plan_csv(plan: MotionPlan) -> str:
    """Return the samples of a plan as CSV.

    Columns: `stop` and `segment`, counted from 0; `type`; `from` and `to`, numbers of goals or
    "rest"; `time` since the begin of the stop's tour [s]; the position of each joint [rad]; its
    velocity [rad/s] under its name with the suffix `_velocity`.
    """
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    velocities = [f"{name}_velocity" for name in plan.joints]
    rows.writerow(["stop", "segment", "type", "from", "to", "time", *plan.joints, *velocities])
    for number, stop in enumerate(plan.stops):
        begin = 0.0
        for index, segment in enumerate(stop.segments):
            ends = ["rest" if end is None else end for end in (segment.start, segment.end)]
            head = [number, index, segment.type, *ends]
            timing = segment.timing
            samples = zip(timing.times, timing.positions, timing.velocities, strict=True)
            for at, q, v in samples:
                numbers = [f"{x + 0.0:.9g}" for x in (*q, *v)]
                rows.writerow([*head, f"{begin + at:.6f}", *numbers])
            begin += timing.duration
    return out.getvalue()
