"""The work of jobs that build a scene: scoring, scoring as observed, evaluation and plans."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tcs.errors import SelectionError, ServiceError
from tcs.files.paths import is_path
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedSet
from tcs.service.conversions import (
    constraints_of,
    observed_of,
    settings_of,
    state_of,
    table_of,
)
from tcs.service.jobs import Progress
from tcs.service.limits import Limits
from tcs.service.requests import (
    EvaluateRequest,
    PlanRequest,
    RescoreRequest,
    SceneRequest,
    ScoreHereRequest,
    ScoreRequest,
)
from tcs.service.score_files import ScoreFiles
from tcs.service.sent_documents import SentDocuments

if TYPE_CHECKING:
    from tcs.model.grid import InitialConfiguration
    from tcs.placement.scoring import LiveScorer
    from tcs.service.rescoring import Rescorer

# Drake and the compiler are loaded by the process that does the work: choosing from files does
# without.


class SceneWork:
    """Does the work of jobs, one at a time."""

    def __init__(self, files: ScoreFiles, sent: SentDocuments, limits: Limits) -> None:
        """Work with the files of a service."""
        self._files, self._sent, self._limits = files, sent, limits
        self._scorer: tuple[str, LiveScorer] | None = None
        """The last live scorer and the request that it is for: building it takes a second."""
        self._rescorer: Rescorer | None = None

    def score(self, request: ScoreRequest, progress: Progress) -> dict[str, Any]:
        """Return the summary of a scored task, as `tcs score --json`, with the digest as `file`.

        Raises:
            TcsError: As `tcs.score`.
        """
        from tcs.placement.scoring import score

        scored = score(
            *self._models(request),
            arms=request.arms,
            on_progress=progress,
            on_compile=progress.compiling,
            **self._options(request),
        )
        return self._held(scored)

    def score_here(self, request: ScoreHereRequest, progress: Progress) -> dict[str, Any]:
        """Return the summary of the task scored in the observed scene; as `score`.

        Raises:
            TcsError: As `tcs.LiveScorer`.
        """
        from tcs.model.scene import Observation, load_environment

        _, environment, _ = self._models(request)
        scorer = self._scorer_of(request, progress.compiling)
        progress(0, 1)
        scored = scorer.score(
            Observation(
                joints=observed_of(request.observed, load_environment(environment).observable_axes),
                frames=request.frames,
                setting=settings_of(request.at, "at"),
            ),
            every=request.every,
            around=request.around,
        )
        progress(1, 1)
        return {**self._held(scored), "observation": scored.metadata["observation"]}

    def prepare(self, names: Mapping[str, str]) -> None:
        """Build the live scorer of a task; compile nothing.

        Any live scorer loads the kernel's machine code; this one serves the likely first request.

        Args:
            names: Task, environment and robot.

        Raises:
            TcsError: As `tcs.LiveScorer`, and if there is no machine code yet.
        """
        if not any(is_path(name) for name in names.values()):
            self._scorer_of(ScoreHereRequest.model_validate(names), _without_compiling)

    def _scorer_of(self, request: ScoreHereRequest, on_compile: Callable[[], None]) -> LiveScorer:
        """Return the live scorer of a request: the last one where only the observation differs."""
        from tcs.placement.scoring import LiveScorer

        only_now = {"observed": {}, "frames": {}, "every": 1, "around": None}
        key = request.model_copy(update=only_now).model_dump_json()
        if self._scorer is None or self._scorer[0] != key:
            self._scorer = None
            scorer = LiveScorer(
                *self._models(request),
                arms=request.arms,
                on_compile=on_compile,
                **self._options(request),
            )
            self._scorer = (key, scorer)
        return self._scorer[1]

    def rescore(self, request: RescoreRequest, progress: Progress) -> dict[str, Any]:
        """Return the summary of the task scored in the changed environment; as `score`.

        Raises:
            StoreMismatchError: If the models are not those the file was made from.
            TcsError: As `tcs.score`, and if a change is not possible.
        """
        from tcs.service.rescoring import Rescorer

        file = self._files.for_scene(request.file)
        if self._rescorer is None:
            self._rescorer = Rescorer(self._sent, self._limits.threads)
        return self._held(self._rescorer.rescored(file, request, progress))

    def evaluate(self, request: EvaluateRequest, progress: Progress) -> dict[str, Any]:
        """Return the success of a set under random errors, as `tcs evaluate --json`.

        Raises:
            TcsError: As `tcs.evaluate`.
        """
        from tcs.motion import evaluate

        file = self._files.for_scene(request.file)
        found = evaluate(
            file,
            samples=request.samples,
            seed=request.seed,
            select=request.select,
            members=request.members,
            table=table_of(file, request) if request.observed or request.frames else None,
            body_collisions=request.body_collisions,
            jobs=self._limits.threads,
            on_progress=progress,
            on_compile=progress.compiling,
        )
        return found.to_json()

    def plan(self, request: PlanRequest, progress: Progress) -> dict[str, Any]:
        """Return the motions from the stops of a set, as `tcs plan --json`.

        Raises:
            TcsError: As `tcs.plan`.
        """
        from tcs.motion import plan

        file = self._files.for_scene(request.file)
        found = plan(
            file,
            self._stops(file, request),
            order=request.order,
            jerk=request.jerk,
            seed=request.seed,
            on_progress=progress,
            on_compile=progress.compiling,
        )
        return found.to_json()

    def scene(self, request: SceneRequest, progress: Progress) -> dict[str, Any]:
        """Return the outlines of the scene from above.

        Raises:
            StoreMismatchError: If the models are not those the file was made from.
        """
        from tcs.service.scene_outlines import scene_outlines

        file = self._files.for_scene(request.file)
        return scene_outlines(file, progress, request.state)

    def _models(self, request: ScoreRequest) -> tuple[Any, Any, str]:
        """Return task, environment and robot by name, or by the path of what was sent."""
        task: Any = request.task
        if request.task_yaml is not None:
            task = self._sent.task(request.task_yaml)
        environment: Any = request.environment
        if request.environment_yaml is not None:
            environment = self._sent.environment(request.environment_yaml)
        return task, environment, request.robot

    def _options(self, request: ScoreRequest) -> dict[str, Any]:
        return {
            "measure": request.measure,
            "approach": request.approach,
            "paper": request.paper,
            "rule": request.rules,
            "same_environment": request.same_environment,
            "max_members": request.max_members,
            "constraints": constraints_of(request),
            "now": settings_of(request.at, "at"),
            "person": request.person,
            "jobs": self._limits.threads,
        }

    def _held(self, scored: ScoreFile) -> dict[str, Any]:
        """Hold a new score file and return its summary."""
        from tcs.output.words import summary_in_words
        from tcs.placement.scoring import summary

        entry = self._files.add_made(scored).entry
        return {
            "task": entry.task,
            "environment": entry.environment,
            **summary_in_words(scored, summary(scored)),
            "file": entry.file,
            "file_bytes": entry.bytes,
        }

    def _stops(
        self, file: ScoreFile, request: PlanRequest
    ) -> Sequence[int] | InitialConfiguration | RefinedSet:
        """Return the stops of a plan, as `tcs plan` chooses them."""
        from tcs.motion.plans import exact_state
        from tcs.output.report.score.shown_set import ShownSet

        observed = observed_of(request.observed, file.observed_axes)
        here = None
        if request.here is not None:
            here = state_of(request.here, request.torso, request.at)
        if request.exactly:
            if here is None:
                raise SelectionError("'exactly' requires 'here'.")
            return exact_state(file, here, observed)
        table, indices = table_of(file, request), tuple(request.configuration)
        if not indices:
            shown = ShownSet.of(file, here, request.max_members, observed)
            if shown.refined is not None:
                return shown.refined
            table, indices = shown.table, shown.indices
        size = file.configurations.size
        for h in indices:
            if not 0 <= h < size:
                raise SelectionError(f"{h} is not a configuration; there are {size:,}, from 0.")
        return [table * size + h for h in indices]


def _without_compiling() -> None:
    """Raise `ServiceError`, where the kernel would be compiled."""
    raise ServiceError("the kernel has no machine code yet; the first job compiles it.")
