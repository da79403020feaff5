"""Words of the studies: names and units of measures, and the goals that a set loses under error."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tcs.output.words.numbers import percent
from tcs.output.words.reasons import REASON_TEXTS, body_name, frame_name

if TYPE_CHECKING:
    from tcs.placement.robustness import Evaluation
    from tcs_studies.experiment.trial import TrialMeasures
    from tcs_studies.robustness.losses import Loss

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


def mean_and_std(evaluation: Evaluation) -> str:
    """Return mean and standard deviation in percent, as the paper prints them."""
    return f"{percent(evaluation.summary.mean)} ({percent(evaluation.summary.std)})"


def lost_goal(loss: Loss) -> str:
    """Return a sentence that states why a goal is lost."""
    return (
        f"Goal {loss.goal + 1} ({frame_name(loss.body_frame)}) is reached in "
        f"{percent(loss.success)} % of the samples; in the others: {stopped_by(loss)}."
    )


def stopped_by(loss: Loss) -> str:
    """Return the reasons why a goal is lost, the most frequent first."""
    text = ", ".join(
        f"{REASON_TEXTS[reason]} ({percent(fraction, 0)} %)"
        for reason, fraction in loss.reasons.items()
        if fraction >= 0.05
    )
    if loss.pair is not None and loss.pair_fraction >= 0.2:
        text += f"; most often {body_name(loss.pair[0])} and {body_name(loss.pair[1])}"
    return text


def goes_with(loss: Loss) -> str:
    """Return the joint error with the largest mean in the losses, in standard deviations."""
    return f"{frame_name(loss.joint)} {loss.standardized_error:+.1f}"
