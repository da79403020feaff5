"""Names and units of the measures of the teleoperation experiment and of questionnaires."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tcs.teleop.experiment.trial import TrialMeasures

NAMES = {
    "accuracy": "accuracy: greatest error of the barycentre [mm]",
    "time": "completion time [s]",
    "effort": "effort: mean absolute work on the device [µJ]",
    "work": "total absolute work on the device [mJ]",
    "steering_angle": "cumulative steering angle [rad]",
    "steering_translation": "cumulative steering translation [m]",
    "arc_length": "spectral arc length [-]",
    "stops": "number of stops of the arm",
    "turned": "rotation of joint 1 by its group [rad]",
    "finished": "fraction of completed trials",
    "planes_met": "normal planes crossed, of 30",
    "start_time": "START: time until the arm first stops [s]",
    "start_work": "START: absolute work on the device [mJ]",
    "solution_time": "SOLUTION: time until all stops are passed [s]",
    "solution_work": "SOLUTION: absolute work on the device [mJ]",
    "finish_time": "FINISH: time on the rest of the line [s]",
    "finish_work": "FINISH: absolute work on the device [mJ]",
    "usefulness": "usefulness, van der Laan [-2 to 2]",
    "satisfaction": "satisfaction, van der Laan [-2 to 2]",
    "workload": "weighted workload, NASA-TLX [0 to 100]",
    "difficulty": "difficulty of the task, agreement [1 to 5]",
}
"""Name of each measure, with the unit in which it is printed."""
SCALE = {
    "accuracy": 1e3,
    "effort": 1e6,
    "work": 1e3,
    "start_work": 1e3,
    "solution_work": 1e3,
    "finish_work": 1e3,
}
"""Factors from SI units to those of `NAMES`."""

PICK_AND_PLACE = {
    "tct": "completion time tct [s]",
    "csa": "cumulative steering angle csa [rad]",
    "cst": "cumulative steering translation cst [m]",
    "sal": "spectral arc length sal [-]",
    "csa_rate": "csa / tct [rad/s]",
    "cst_rate": "cst / tct [m/s]",
    "approach": "approach [s]",
    "transfer": "transfer [s]",
    "retreat": "retreat [s]",
    "actions": "gripper actions",
    "corrections": "corrections of the place",
}
"""Name of each measure of the pick-and-place experiment, in the unit of its value."""


def trial_words(measures: TrialMeasures, time_limit: float) -> str:
    """Return the result of a trial in a few words."""
    worst = f"greatest error of the mean path {1e3 * measures.accuracy:.1f} mm"
    if not measures.finished:
        return f"the end was not reached: counts with {time_limit:g} s; {worst}"
    return f"{measures.time:.1f} s; {worst}"
