"""Motions: timed, certified trajectories of the arm that do a task from the stops of a set.

In: a score file and the configurations of a set. Out: plans, as values and as files: at each stop
the tour from rest through the goals and back, and for every goal without a motion the reason; and,
for all configurations worth it, which goals can be done.
"""

from __future__ import annotations

from tcs.motion.approach import Access, Accesses, accesses
from tcs.motion.approach_check import ApproachCheck, check_approaches
from tcs.motion.curves import Curve
from tcs.motion.examine import examine
from tcs.motion.motion_plan import GoalResult, MotionPlan, Segment, StopPlan
from tcs.motion.plan_check import PlanCheck, check_plan
from tcs.motion.plan_files import save_plan
from tcs.motion.plan_success import PlanSuccess, evaluate_plan
from tcs.motion.plans import plan
from tcs.motion.rooms import evaluate, refine, robustify
from tcs.motion.stops import Stop
from tcs.motion.stored_plan import load_plan
from tcs.motion.timing import Timed

__all__ = [
    "Access",
    "Accesses",
    "ApproachCheck",
    "Curve",
    "GoalResult",
    "MotionPlan",
    "PlanCheck",
    "PlanSuccess",
    "Segment",
    "Stop",
    "StopPlan",
    "Timed",
    "accesses",
    "check_approaches",
    "check_plan",
    "evaluate",
    "evaluate_plan",
    "examine",
    "load_plan",
    "plan",
    "refine",
    "robustify",
    "save_plan",
]
