"""One engine for all programs: score, select, explain, evaluate and plan as requests.

In: requests as pydantic models, score files and task files as bytes. Out: the plain containers that
the command line prints with `--json`, and the states of jobs. `Engine` answers in this process;
`tcs.service.http` serves it over HTTP, `tcs.service.client.Client` sends requests to such a server
by the same methods, and `tcs.service.assistant` offers them as tools of an assistant.
"""

from __future__ import annotations

from tcs.service.engine import Engine
from tcs.service.limits import Limits
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
from tcs.service.responses import FileEntry, JobStatus

__all__ = [
    "Engine",
    "EvaluateRequest",
    "ExplainRequest",
    "FileEntry",
    "FloorRequest",
    "JobStatus",
    "Limits",
    "MotionsRequest",
    "OutcomeRequest",
    "PlanRequest",
    "PopulationRequest",
    "PostureRequest",
    "RefineRequest",
    "RescoreRequest",
    "SceneRequest",
    "ScoreHereRequest",
    "ScoreRequest",
    "SelectRequest",
]
