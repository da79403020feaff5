"""Score a task of your own: a few poses of the tool on the body.

`wiping.yaml` beside this file is a task. Goals are fixed to a part of the body and move with it,
whatever the state of the bed and the position of the person.
"""

from __future__ import annotations

from pathlib import Path

import tcs
from tcs.model.tasks import load_task

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Read the task, score it, and print which goals the best configuration reaches."""
    # An invalid file raises an error of one line: file, field, and allowed values.
    task = load_task(HERE / "wiping.yaml")
    print(f"{task.name}: {len(task.goals)} goals, weights {task.weights.tolist()}")

    file = tcs.score(task)
    best = file.nominal.sets.best_single[0]
    # The scores hold a row for each configuration of the grid and a column for each goal.
    print("The best configuration reaches:", file.nominal.scores.reached[best].tolist())


if __name__ == "__main__":
    main()
