"""Refinement: the best sets of a score file, moved between the grid points.

In: a score file. Out: the file with refined sets beside those of its grid.
"""

from __future__ import annotations

from tcs.placement.refinement.place import Placement, place
from tcs.placement.refinement.points import (
    PointScorer,
    PointScores,
    RefinedMembers,
    score_members,
)
from tcs.placement.refinement.refined_file import OBJECTIVES, refine, refinement_summary

__all__ = [
    "OBJECTIVES",
    "Placement",
    "PointScorer",
    "PointScores",
    "RefinedMembers",
    "place",
    "refine",
    "refinement_summary",
    "score_members",
]
