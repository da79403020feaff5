"""Score the same task with other robots: two shipped ones, and a PR2 that holds a spoon.

`pr2_spoon.yaml` beside this file is the PR2 with a further body and another tool frame. Any robot
whose arm has seven revolute joints is supported; `tcs robot new` drafts its file from a URDF.
"""

from __future__ import annotations

from pathlib import Path

import tcs

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Score shaving with three robots."""
    for robot in ("pr2", HERE / "pr2_spoon.yaml", "panda"):
        file = tcs.score("shaving", environment="wheelchair", robot=robot)
        best = tcs.summary(file)["best_single"]
        # P_R compares robots. P_M does not: its Jacobian mixes metres and radians.
        reachability = best["reachability"]
        print(f"{file.robot['name']}: {reachability:.0%} of the goals from the best base pose")


if __name__ == "__main__":
    main()
