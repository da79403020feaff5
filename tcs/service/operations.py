"""The requests with a body: their paths, models and the methods of the engine that answer them."""

from __future__ import annotations

from dataclasses import dataclass

from tcs.files.documents import Document
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

    @property
    def path(self) -> str:
        """Path of the request."""
        return f"/v1/{self.name}"

    @property
    def summary(self) -> str:
        """What it does: the first sentence of the model's docstring."""
        return " ".join((self.request.__doc__ or "").split())


OPERATIONS = (
    Operation("select", SelectRequest, is_job=False, takes_turns=True),
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
