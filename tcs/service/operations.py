"""The requests with a body: their paths, models and the methods of the engine that answer them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from tcs.files.documents import Document
from tcs.placement.selection.distances import ROUTES
from tcs.service.requests import (
    EvaluateRequest,
    ExplainRequest,
    FloorRequest,
    MotionsRequest,
    OutcomeRequest,
    PlanRequest,
    PopulationRequest,
    PostureRequest,
    RefineRequest,
    RescoreRequest,
    SceneRequest,
    ScoreHereRequest,
    ScoreRequest,
    SelectRequest,
)


@dataclass(frozen=True, slots=True)
class Operation:
    """A request with a body of JSON."""

    name: str
    """Last part of its path, and name of its command."""
    request: type[Document]
    """Model of the body."""
    is_job: bool
    """Whether it is queued as a job."""
    takes_turns: bool = False
    """Whether requests about one score file are answered one after the other."""
    bounded: frozenset[str] = frozenset()
    """Fields, beside those of the robot's state, with which its work depends on the file alone."""

    def kind_of(self, request: Any) -> Hashable | None:
        """Return what requests that take equally long have in common; None if that is not known.

        Where the robot is does not change the work: every set of the file is compared, once.
        """
        fields = request.model_fields_set - _STATE
        if not self.bounded or not fields <= self.bounded:
            return None
        return (
            self.name,
            request.here is None,
            *((name, repr(getattr(request, name))) for name in sorted(fields)),
        )

    @staticmethod
    def is_long(request: Any) -> bool:
        """Return whether a step of the work lets no other thread of its process go on for long.

        The search for paths around the furniture takes as long as a hundred selections.
        """
        return getattr(request, "travel", ROUTES[0]) != ROUTES[0]

    @property
    def path(self) -> str:
        """Path of the request."""
        return f"/v1/{self.name}"

    @property
    def summary(self) -> str:
        """What it does: the first sentence of the model's docstring."""
        return " ".join((self.request.__doc__ or "").split())


_STATE = {"here", "torso", "at"}
_WEIGHTS = frozenset(
    "file alpha beta gamma delta metre_weight turn_weight torso_weight place_penalty "
    "environment_penalty preference_penalty max_members".split()
)

OPERATIONS = (
    Operation("select", SelectRequest, is_job=False, takes_turns=True, bounded=_WEIGHTS),
    Operation("explain", ExplainRequest, is_job=False, takes_turns=True),
    Operation("floor", FloorRequest, is_job=False, takes_turns=True),
    Operation("outcome", OutcomeRequest, is_job=False, takes_turns=True),
    Operation("posture", PostureRequest, is_job=False),
    Operation("score", ScoreRequest, is_job=True),
    Operation("score-here", ScoreHereRequest, is_job=True),
    Operation("rescore", RescoreRequest, is_job=True),
    Operation("evaluate", EvaluateRequest, is_job=True),
    Operation("plan", PlanRequest, is_job=True),
    Operation("population", PopulationRequest, is_job=True),
    Operation("refine", RefineRequest, is_job=True),
    Operation("motions", MotionsRequest, is_job=True),
    Operation("scene", SceneRequest, is_job=True),
)
"""Every request with a body of JSON."""
