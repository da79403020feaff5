"""Goals lost under error: the reasons, and the joint error that is largest in the losses."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.placement.robustness.evaluation import Evaluation
from tcs.placement.robustness.trials import Trials
from tcs.placement.tables import Reason


@dataclass(frozen=True)
class Loss:
    """A goal that is not reached in some samples."""

    goal: int
    """Number of the goal."""
    body_frame: str
    """Frame of the body part or furniture that the goal is fixed to."""
    success: float
    """Fraction of the samples in which it is reached."""
    member: int
    """Number of the set's member that reaches it most often."""
    reasons: dict[Reason, float]
    """Why that member fails in the other samples: fraction of each reason, most frequent first."""
    pair: tuple[str, str] | None
    """The most frequent colliding pair of bodies in these samples, if there is one."""
    pair_fraction: float
    """Fraction of these samples in which that pair collides."""
    joint: str
    """The joint whose mean error in these samples is greatest in standard deviations."""
    standardized_error: float
    """That mean error divided by the standard deviation over all samples."""

    def to_json(self) -> dict[str, Any]:
        """Return the loss as plain containers."""
        return {
            "goal": self.goal,
            "body_frame": self.body_frame,
            "success": self.success,
            "member": self.member,
            "reasons": {reason.name.lower(): part for reason, part in self.reasons.items()},
            "pair": list(self.pair) if self.pair else None,
            "pair_fraction": self.pair_fraction,
            "joint": self.joint,
            "standardized_error": self.standardized_error,
        }


@dataclass(frozen=True)
class Losses:
    """Goals that a set loses under error, and an upper bound for every set."""

    goals: tuple[Loss, ...]
    """The goals that are not reached in every sample, least often reached first."""
    ceiling: float
    """Upper bound on the mean fraction of goals reached by any set that leaves the environment in
    the states of this set's members: at the other goals the gripper touches the environment, which
    depends neither on base pose nor on torso height. Contacts of the gripper with the robot do, so
    they do not lower the bound."""

    def to_json(self) -> dict[str, Any]:
        """Return the losses as plain containers."""
        return {"ceiling": self.ceiling, "goals": [loss.to_json() for loss in self.goals]}


def losses(trials: Trials, evaluation: Evaluation) -> Losses:
    """Return the goals that a set does not reach in every sample, and why.

    Args:
        trials: The trials that the set was evaluated with.
        evaluation: Evaluation of a single set, not of sets drawn at random.
    """
    lost = ~evaluation.reached
    if not lost.any():
        return Losses((), 1.0)
    offsets = evaluation.offsets
    outcomes = [trials.outcome(int(h), offsets) for h in evaluation.sets[0]]
    reached = np.array([found.scores.reason == Reason.REACHED for found in outcomes])
    # A gripper blocked by the robot may be free from another base pose.
    blocked = Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT
    unavoidable = np.all([found.scores.reason == blocked for found in outcomes], axis=0)
    found = []
    for goal in np.flatnonzero(lost.any(axis=0)).tolist():
        rows = lost[:, goal]
        member = int(reached[:, :, goal].sum(axis=1).argmax())
        scores, hand = outcomes[member]
        reasons = Counter(scores.reason[rows, goal].tolist())
        contacts = Counter(
            (number, code)
            for number, code in zip(
                hand[rows, goal].tolist(), scores.contact[rows, goal].tolist(), strict=True
            )
            if code >= 0
        )
        (of_hand, pair), times = contacts.most_common(1)[0] if contacts else ((0, -1), 0)
        lowered = trials.hands[of_hand].lowered
        robot = lowered.robot_bodies
        others = (*lowered.environment_bodies, *robot)
        errors = {
            name: float(values[rows].mean() / values.std())
            for name, values in offsets.items()
            if values.std() > 0.0
        }
        joint = max(errors, key=lambda name: abs(errors[name]), default="")
        found.append(
            Loss(
                goal=goal,
                body_frame=trials.task.goals[goal].body_frame,
                success=float(1.0 - rows.mean()),
                member=member,
                reasons={Reason(r): n / int(rows.sum()) for r, n in reasons.most_common()},
                pair=(robot[pair // len(others)], others[pair % len(others)]) if times else None,
                pair_fraction=times / int(rows.sum()),
                joint=joint,
                standardized_error=errors.get(joint, 0.0),
            )
        )
    found.sort(key=lambda loss: loss.success)
    return Losses(tuple(found), float(np.mean(~unavoidable @ evaluation.weights)))
