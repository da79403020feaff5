"""Compare the scores of this checkout with those of another commit, bit by bit.

Usage: python scripts/scores_identity.py CHECKOUT [--rows TASK:ENVIRONMENT ...] [--robots ROBOT ...]
           [--kept FOLDER]

CHECKOUT is a folder with the other commit, as `git worktree add --detach CHECKOUT COMMIT` makes it.
Each side scores in a process of its own, with its own models and tasks, as in the papers: exact
poses, without approach. Printed is one line for each row and robot: `equal` with the digest of
reasons, pairs of bodies, dexterity and joints, or for each of these how many values differ and by
how much at most. Returns 1 if any differ. The scores of the other side are kept in --kept, if
given, for the next comparison.

Robots whose shapes or rules were changed on purpose since differ from old commits rightly: since
a24563ca a configuration counts only if the arm at rest is free, and shapes were mended.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tcs.model.robots import robot_names
from tcs.model.tasks import load_task, task_names

HERE = Path(__file__).resolve().parents[1]
COLUMNS = ("reason", "pair", "dexterity", "joints")

SCORE = """
import sys
import numpy as np
import tcs
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.job import JobOptions

task, environment, robot, out = sys.argv[1:]
# Commits without this option scored exact poses only.
options = {"paper": True} if "paper" in JobOptions.__annotations__ else {}
job = load_job(task, environment, robot, **options)
(table,) = sweep(job.lowered(job.scene()), job.task.weights).tables
np.savez(
    out,
    reason=table.reason,
    pair=table.pair,
    names=table.pair_names,
    dexterity=table.dexterity,
    joints=table.arm_joints,
)
"""


def main() -> int:
    """Score every row on both sides and print how they compare; return 1 if some differ."""
    options = parse()
    code = 0
    with tempfile.TemporaryDirectory() as folder:
        for row in options.rows or all_rows():
            for robot in options.robots or robot_names():
                kept = Path(options.kept or folder)
                kept.mkdir(parents=True, exist_ok=True)
                before = kept / f"{row.replace(':', '-')}-{robot}.npz"
                if options.kept is None or not before.exists():
                    score(options.checkout, row, robot, before)
                after = Path(folder) / "here.npz"
                score(HERE, row, robot, after)
                text = comparison(dict(np.load(before)), dict(np.load(after)))
                code = code if text.startswith("equal") else 1
                print(f"{row} {robot}: {text}", flush=True)
    return code


def parse() -> argparse.Namespace:
    """Return the command line's options."""
    command_line = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    command_line.add_argument("checkout", type=Path)
    command_line.add_argument("--rows", nargs="+", help="all if left out")
    command_line.add_argument("--robots", nargs="+", help="all if left out")
    command_line.add_argument("--kept", help="folder of the scores of CHECKOUT")
    return command_line.parse_args()


def all_rows() -> list[str]:
    """Return every task in each of its environments."""
    tasks = map(load_task, task_names())
    return [f"{task.name}:{environment}" for task in tasks for environment in task.environments]


def score(checkout: Path, row: str, robot: str, out: Path) -> None:
    """Write the scores of a row by a checkout to a file."""
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    subprocess.run(
        [sys.executable, "-c", SCORE, *row.split(":"), robot, str(out)],
        cwd=checkout,
        env=environment,
        check=True,
    )


def comparison(before: dict[str, npt.NDArray], after: dict[str, npt.NDArray]) -> str:
    """Return `equal` with the digest, or what differs."""
    after["pair"] = renumbered(after.pop("names"), before.pop("names"))[after["pair"]]
    reached = before["reason"] == 0
    same = np.array_equal(reached, after["reason"] == 0)
    texts = []
    for name in COLUMNS:
        old, new = before[name], after[name]
        if old.shape == new.shape and old.tobytes() == new.astype(old.dtype).tobytes():
            continue
        if old.shape != new.shape:
            texts.append(f"{name} {old.shape} {new.shape}")
        else:
            differs = old != new
            text = f"{name} {np.count_nonzero(differs)} of {old.size}"
            if old.dtype.kind == "f" and same:
                text += f", at most {np.abs(old - new).max():.2g}"
            texts.append(text)
    if texts:
        return "; ".join(texts)
    sha = hashlib.sha256(b"".join(np.ascontiguousarray(after[name]).tobytes() for name in COLUMNS))
    return f"equal, {sha.hexdigest()[:16]}, {np.count_nonzero(reached)} pairs reached"


def renumbered(names: npt.NDArray, others: npt.NDArray) -> npt.NDArray:
    """Return the number among others of each pair of names, further ones for new pairs, then -1."""
    known = {tuple(pair): i for i, pair in enumerate(others.tolist())}
    numbers = [known.setdefault(tuple(pair), len(known)) for pair in names.tolist()]
    return np.array([*numbers, -1])


if __name__ == "__main__":
    sys.exit(main())
