"""Names and units of the measures of the teleoperation experiment."""

from __future__ import annotations

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
}
"""Name of each measure, with the unit in which it is printed."""
SCALE = {"accuracy": 1e3, "effort": 1e6, "work": 1e3}
"""Factors from SI units to those of `NAMES`."""
