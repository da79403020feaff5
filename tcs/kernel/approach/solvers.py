"""The search for approachable postures, for every solver of the inverse kinematics.

As in `tcs.kernel.solvers`, the type of the solver selects the implementation when numba compiles
the caller.
"""

from __future__ import annotations

from typing import Any, ClassVar, cast

from numba.core.typing.templates import infer_global

from tcs.kernel.analytic.scratch import Search
from tcs.kernel.approach import listed, pairs, traced
from tcs.kernel.approach.memory import AnyApproach
from tcs.kernel.arrays import FloatArray
from tcs.kernel.five_joints.score_turned import FiveJointSolver
from tcs.kernel.numeric.search import NumericSolver
from tcs.kernel.problem import Problem
from tcs.kernel.six_joints.score_solutions import SixJointSolver
from tcs.kernel.solvers import OfSolver
from tcs.kernel.views import field_class

PAIR: dict[type, Any] = {
    Search: pairs.approach_pair,
    NumericSolver: traced.approach_pair,
    SixJointSolver: listed.approach_of_six,
    FiveJointSolver: listed.approach_of_five,
}
FOLLOW: dict[type, Any] = {
    Search: pairs.follow_posture,
    NumericSolver: listed.follow_posture,
    SixJointSolver: listed.follow_posture,
    FiveJointSolver: listed.follow_posture,
}


def approach_pair(
    problem: Problem, approach: AnyApproach, fastest: FloatArray, q: FloatArray
) -> int:
    """Find the best posture of a reached pair that can be left backwards along the approach.

    Args:
        problem: The scene.
        approach: `work`, `scene` and `offset` are in place. `search.best` is filled with the joint
            angles [rad] if another posture than q is the best, `contact` if all are blocked.
        fastest: Greatest motion of each joint for the whole line at constant rate [rad], shape
            (7,).
        q: Joint angles that scoring found [rad], shape (7,).

    Returns:
        REACHED, APPROACH_LIMITS or APPROACH_BLOCKED; -1 if q itself is approachable.
    """
    return cast(int, PAIR[type(approach.search)](problem, approach, fastest, q))


def follow_posture(
    problem: Problem, approach: AnyApproach, fastest: FloatArray, q: FloatArray
) -> int:
    """Follow the line from a posture at the goal; return DONE if it succeeds.

    Args:
        problem: The scene.
        approach: As for `approach_pair`; the spline is filled.
        fastest: As for `approach_pair`.
        q: Joint angles of a posture free of contact [rad], shape (7,).
    """
    return cast(int, FOLLOW[type(approach.search)](problem, approach, fastest, q))


class _OfApproach(OfSolver):
    """Types a call by the type of the solver in its second argument, the memory."""

    @staticmethod
    def solver(args: Any) -> type:
        return field_class(args[1], "search")


@infer_global(approach_pair)
class _ApproachPair(_OfApproach):
    implementations: ClassVar[dict[type, Any]] = PAIR
    entries: ClassVar[dict[Any, Any]] = {}


@infer_global(follow_posture)
class _FollowPosture(_OfApproach):
    implementations: ClassVar[dict[type, Any]] = FOLLOW
    entries: ClassVar[dict[Any, Any]] = {}
