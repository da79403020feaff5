"""Results under error: the goals that a set loses, and the distributions of the errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tcs.output.words.bodies import body_name, frame_name
from tcs.output.words.numbers import percent
from tcs.output.words.reasons import REASON_TEXTS

if TYPE_CHECKING:
    # Estimating losses needs the compiler; wording them does not.
    from tcs.placement.robustness import Evaluation, Loss


BODY_COLLISIONS = {
    "paper": "of the robot's body count, except those of the base with the furniture",
    "all": "of the robot's body count",
    "none": "of the robot's body are ignored",
}
"""What the collisions of base, torso, head and other arm mean for a sample."""


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


def error_width(error: Mapping[str, Any]) -> str:
    """Return the width of the distribution of an error.

    >>> error_width({"distribution": "normal", "std": 0.05})
    'standard deviation 0.05 m'
    >>> error_width({"distribution": "uniform", "half_width_deg": 5.0})
    'uniform ±5 deg'
    """
    (key, width) = next((k, v) for k, v in error.items() if k != "distribution")
    unit = "deg" if key.endswith("_deg") else "m"
    sign = "standard deviation " if error["distribution"] == "normal" else "uniform ±"
    return f"{sign}{width:g} {unit}"
