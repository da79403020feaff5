"""What stops a goal from being reached when the room is off, and which error it goes with."""

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
    """One goal that some samples lose."""

    goal: int
    """Number of the goal."""
    body_frame: str
    """What it rides on."""
    success: float
    """Share of the samples in which it is reached."""
    member: int
    """Number of the set's member that reaches it most often."""
    reasons: dict[Reason, float]
    """Why that member fails in the other samples: share of each reason, most frequent first."""
    pair: tuple[str, str] | None
    """The two bodies that are most often in each other's way there."""
    pair_fraction: float
    """In which share of the losses."""
    joint: str
    """The joint whose error tells losses from the rest best."""
    standardized_error: float
    """By how many of its standard deviations that error is off on average in the losses."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "goal": self.goal,
            "body_frame": self.body_frame,
            "success": self.success,
            "member": self.member,
            "reasons": {reason.name.lower(): share for reason, share in self.reasons.items()},
            "pair": list(self.pair) if self.pair else None,
            "pair_fraction": self.pair_fraction,
            "joint": self.joint,
            "standardized_error": self.standardized_error,
        }


@dataclass(frozen=True)
class Losses:
    """What a set loses when the room is off."""

    goals: tuple[Loss, ...]
    """The goals that are not reached in every sample, the worst first."""
    ceiling: float
    """The greatest mean share of goals that any set could reach with the room set as this one
    sets it: the gripper at the other goals touches something, wherever the robot stands."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {"ceiling": self.ceiling, "goals": [loss.to_json() for loss in self.goals]}


def losses(trials: Trials, evaluation: Evaluation) -> Losses:
    """Return the goals that a set does not reach in every sample, and why.

    Args:
        trials: What the set was evaluated with.
        evaluation: Of one set, not of drawn ones.
    """
    lost = ~evaluation.reached
    if not lost.any():
        return Losses((), 1.0)
    offsets = evaluation.offsets
    outcomes = [trials.outcome(int(h), offsets) for h in evaluation.sets[0]]
    reached = np.array([found.reason == Reason.REACHED for found in outcomes])
    barred = np.all([found.reason == Reason.GRIPPER_BLOCKED for found in outcomes], axis=0)
    robot, room = trials.lowered.robot_bodies, trials.lowered.room_bodies
    others = (*room, *robot)
    found = []
    for goal in np.flatnonzero(lost.any(axis=0)).tolist():
        rows = lost[:, goal]
        member = int(reached[:, :, goal].sum(axis=1).argmax())
        reasons = Counter(outcomes[member].reason[rows, goal].tolist())
        contacts = Counter(outcomes[member].contact[rows, goal].tolist())
        del contacts[-1]
        pair, times = contacts.most_common(1)[0] if contacts else (-1, 0)
        tilts = {
            name: float(values[rows].mean() / values.std())
            for name, values in offsets.items()
            if values.std() > 0.0
        }
        joint = max(tilts, key=lambda name: abs(tilts[name]), default="")
        found.append(
            Loss(
                goal=goal,
                body_frame=trials.job.task.goals[goal].body_frame,
                success=float(1.0 - rows.mean()),
                member=member,
                reasons={Reason(r): n / int(rows.sum()) for r, n in reasons.most_common()},
                pair=(robot[pair // len(others)], others[pair % len(others)]) if times else None,
                pair_fraction=times / int(rows.sum()),
                joint=joint,
                standardized_error=tilts.get(joint, 0.0),
            )
        )
    found.sort(key=lambda loss: loss.success)
    return Losses(tuple(found), float(np.mean(~barred @ evaluation.weights)))
