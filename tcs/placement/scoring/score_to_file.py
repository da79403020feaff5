"""Score tasks to files: one task, an observed scene, or every row of the paper's Table I."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from tcs.errors import TaskError
from tcs.files.writing import check_writable, make_folder
from tcs.model.scene import Observation, environment_names, load_environment
from tcs.model.tasks import load_task, task_names
from tcs.placement.scoring.dry_run import estimate
from tcs.placement.scoring.live import LiveScorer
from tcs.placement.scoring.offline import load_setups, score
from tcs.placement.scoring.score_summary import summary
from tcs.placement.scoring.sets import SetOptions
from tcs.placement.store import ScoreFile, save_scores


def task_environment_pairs(environment: str | None = None) -> tuple[tuple[str, str], ...]:
    """Return the names of task and environment of every row that `tcs` ships.

    Args:
        environment: Return only the rows in this environment.

    Returns:
        The rows, one environment after the other, with sorted tasks.

    Raises:
        UnknownNameError: If there is no such environment.
        TaskError: If no task has goals in it.
    """
    if environment is not None:
        load_environment(environment)
    tasks = {name: load_task(name).environments for name in task_names()}
    environments = environment_names() if environment is None else (environment,)
    found = tuple(
        (task, name) for name in environments for task, allowed in tasks.items() if name in allowed
    )
    if not found:
        known = sorted({name for allowed in tasks.values() for name in allowed})
        raise TaskError(
            f"No task has goals in environment '{environment}'. "
            f"There are tasks for: {', '.join(known)}."
        )
    return found


def default_path(task: str, environment: str, robot: str, arms: str | None = None) -> Path:
    """Return the default path of a score file, in the current folder.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.
        arms: Name of an arm, or "both"; None for that of the robot file.

    >>> str(default_path("shaving", "environments/kitchen.yaml", "pr2"))
    'shaving-kitchen-pr2.tcs'
    """
    names = [Path(name).stem for name in (task, environment, robot)]
    return Path("-".join(names + ([arms] if arms else [])) + ".tcs")


class Progress(Protocol):
    """Reports the progress of one scoring job."""

    def __call__(self, task: str) -> Any:
        """Return a context manager that yields `on_progress(done, total)`."""


def score_to_file(
    task: str,
    environment: str,
    robot: str,
    path: Path,
    *,
    observation: Observation | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Score a task, write its file and return the summary.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.
        path: File to write.
        observation: Observed joint values or frames; None for the environment as it is described.
        on_progress: Called with the number of configurations done and in total.
        **options: Further options of `tcs.score`.

    Raises:
        OutputError: If the file cannot be written or is an input; reported before scoring begins.
        TcsError: As `tcs.score`.
    """
    check_writable(path, (task, environment, robot))
    if observation is None:
        file = score(task, environment, robot, on_progress=on_progress, **options)
    else:
        work = {key: options.pop(key) for key in ("blocks", "engine") if key in options}
        scorer = LiveScorer(task, environment, robot, **options)
        file = scorer.score(observation, on_progress=on_progress, **work)
    save_scores(path, file)
    return saved_summary(path, file)


def score_all_to_files(
    environment: str | None,
    robot: str,
    folder: Path,
    *,
    arms: str | None = None,
    progress: Progress,
    **options: Any,
) -> list[dict[str, Any]]:
    """Score every task in each of its environments, one file each, and return the summaries.

    Args:
        environment: Restrict to this environment; None for all.
        robot: Name or path of a robot.
        folder: Folder of the files; created if missing.
        arms: Name of an arm, or "both"; None for that of the robot file.
        progress: Reports the progress of each task.
        **options: Further options of `tcs.score`.

    Raises:
        OutputError: If the folder cannot be made or written.
        TcsError: As `tcs.score`. Files of earlier rows are kept.
    """
    rows = task_environment_pairs(environment)
    make_folder(folder, advice="Name one with --out.")
    results = []
    for task, name in rows:
        path = folder / default_path(task, name, robot, arms)
        with progress(task) as on_progress:
            results.append(
                score_to_file(
                    task, name, robot, path, arms=arms, on_progress=on_progress, **options
                )
            )
    return results


def estimate_all(
    task: str | None,
    environment: str | None,
    robot: str,
    *,
    observation: Observation | None = None,
    measure: str,
    jobs: int,
    on_compile: Callable[[], None] | None = None,
    **options: Any,
) -> list[dict[str, Any]]:
    """Estimate what scoring would take, for one task or, as `score_all_to_files`, for all.

    Args:
        task: Name or path of a task; None for all.
        environment: Name or path of an environment; None for the default or for all.
        robot: Name or path of a robot.
        observation: Observed joint values or frames; None for the environment as it is described.
        measure: Name of the dexterity measure.
        jobs: Number of threads.
        on_compile: Called before the kernel compiles, if it has to.
        **options: Further options of `tcs.score`; forbidden regions are not subtracted.

    Raises:
        TcsError: As `tcs.score`.
    """
    pairs = (
        task_environment_pairs(environment)
        if task is None
        else ((task, environment or "wheelchair"),)
    )
    sets: Any = {key: options.pop(key) for key in SetOptions.__annotations__ if key in options}
    found = []
    for name, where in pairs:
        if observation is None:
            setups = load_setups(
                name, where, robot, measure=measure, jobs=jobs, sets=sets, **options
            )
            found.append(estimate(setups, on_compile=on_compile))
        else:
            scorer = LiveScorer(
                name, where, robot, measure=measure, jobs=jobs, on_compile=on_compile, **sets,
                **options,
            )  # fmt: skip
            found.append(scorer.estimate(observation))
    return [one.to_json() for one in found]


def saved_summary(path: Path, file: ScoreFile) -> dict[str, Any]:
    """Return the summary of a score file and where it was saved, as plain containers."""
    return {
        "task": file.task["name"],
        "environment": file.environment["name"],
        **summary(file),
        "file": str(path),
        "file_bytes": path.stat().st_size,
        **{key: file.metadata[key] for key in ("observation",) if key in file.metadata},
    }
