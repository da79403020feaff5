"""Write a task of your own: a few poses of the tool on the body.

`wiping.yaml` beside this file is one. Goals are tied to a part of the body and go with it, however
the bed is set and wherever the person is found.
"""

from __future__ import annotations

from pathlib import Path

import tcs
from tcs.model.tasks import load_task

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Read the task, score it, and see which goals the best place reaches."""
    # A mistake in the file would be told here, in one line: file, field, and what is allowed.
    task = load_task(HERE / "wiping.yaml")
    print(f"{task.name}: {len(task.goals)} goals, weights {task.weights.tolist()}")

    file = tcs.score(task)
    best = file.nominal.sets.best_single[0]
    # The scores hold a row for each configuration of the grid and a column for each goal.
    print("The best place to stand reaches:", file.nominal.scores.reached[best].tolist())


if __name__ == "__main__":
    main()
