"""Options of `tcs capability merge` for errors of the base and of the task."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from tcs.capability import BasePose, GraspTask, PoseErrors, Surroundings


@dataclass(frozen=True, kw_only=True)
class ErrorOptions:
    """Errors under which base poses are judged."""

    base_error: Annotated[
        float,
        typer.Option(
            help="With --environment: standard deviation of x and y of the base, in metres."
        ),
    ] = 0.0
    base_yaw_error_deg: Annotated[
        float, typer.Option(help="The same of the base's heading, in degrees.")
    ] = 0.0
    task_error: Annotated[
        float, typer.Option(help="The same of x and y of the tool poses, in metres.")
    ] = 0.0
    task_yaw_error_deg: Annotated[
        float, typer.Option(help="The same of a rotation of the tool poses, in degrees.")
    ] = 0.0
    judge: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="With --environment: another base pose in the task frame to judge (m, m, deg).",
            show_default="none",
        ),
    ] = None
    error_samples: Annotated[int, typer.Option(help="Samples of the errors.")] = 300
    error_seed: Annotated[int, typer.Option(help="Seed of these samples.")] = 0

    @property
    def given(self) -> bool:
        """Whether anything is to be judged."""
        errors = (self.base_error, self.base_yaw_error_deg, self.task_error)
        return self.judge is not None or any((*errors, self.task_yaw_error_deg))

    def errors(self) -> PoseErrors:
        """Return the errors.

        Raises:
            TaskError: If one is out of range.
        """
        from tcs.capability import PoseErrors

        return PoseErrors(
            base_position=self.base_error,
            base_yaw=math.radians(self.base_yaw_error_deg),
            task_position=self.task_error,
            task_yaw=math.radians(self.task_yaw_error_deg),
        )

    def judged(self, around: Surroundings, task: GraspTask, best: BasePose) -> list[dict[str, Any]]:
        """Return the success of the best base pose, and of the other one if it is given.

        Args:
            around: The environment.
            task: The task.
            best: The best base pose; the other one has its torso height.

        Raises:
            TcsError: If an option is out of range.
        """
        from tcs.capability import BasePose, success_under_error

        bases = [best]
        if self.judge is not None:
            x, y, yaw_deg = self.judge
            bases.append(BasePose(x, y, math.radians(yaw_deg), best.torso_height, math.nan))
        found = []
        for base in bases:
            pose = base.to_json()
            # Only base poses of the map have a score.
            if math.isnan(pose["score"]):
                del pose["score"]
            success = success_under_error(
                around, task, base, self.errors(), samples=self.error_samples, seed=self.error_seed
            )
            found.append({"base": pose, **success.to_json()})
        return found
