"""Score tasks and write their files: one, or every row of the paper's table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tcs
from tcs.cli import talk
from tcs.cli.places import check_writable
from tcs.files.writing import make_folder
from tcs.placement.scoring import default_path, task_environment_pairs


def score_one(
    task: str, environment: str, robot: str, path: Path, *, jobs: int, **sets: Any
) -> dict[str, Any]:
    """Score a task, write its file and return the summary.

    Args:
        task: Name or path of a task.
        environment: Name or path of an environment.
        robot: Name or path of a robot.
        path: File to write.
        jobs: Number of threads.
        **sets: Options of `tcs.score`: the measure, and which sets are kept.

    Raises:
        OutputError: If the file cannot be written, before anything is scored.
        TcsError: Whatever `tcs.score` raises.
    """
    check_writable(path)
    with talk.progress_bar(f"configurations, {Path(task).stem}") as on_progress:
        file = tcs.score(
            task,
            environment,
            robot,
            jobs=jobs,
            **sets,
            on_progress=on_progress,
            on_compile=talk.say_compiling,
        )
        tcs.save(path, file)
    return saved_summary(path, file)


def saved_summary(path: Path, file: tcs.ScoreFile) -> dict[str, Any]:
    """Return what was scored, and where it was saved to, as plain containers."""
    return {
        "task": file.task["name"],
        "environment": file.environment["name"],
        **tcs.summary(file),
        "file": str(path),
        "file_bytes": path.stat().st_size,
    }


def score_all(
    environment: str | None, robot: str, folder: Path, *, jobs: int, **sets: Any
) -> list[dict[str, Any]]:
    """Score every task in every environment it is for, one file each, and return the summaries.

    Args:
        environment: Only this one.
        robot: Name or path of a robot.
        folder: Where the files go; made if it is not there.
        jobs: Number of threads.
        **sets: Options of `tcs.score`: the measure, and which sets are kept.

    Raises:
        OutputError: If the folder cannot be made or written.
        TcsError: Whatever `tcs.score` raises. What was scored before is kept.
    """
    rows = task_environment_pairs(environment)
    make_folder(folder, advice="Name one with --out.")
    return [
        score_one(task, room, robot, folder / default_path(task, room, robot), jobs=jobs, **sets)
        for task, room in rows
    ]
