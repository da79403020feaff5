"""Hold the forearm with one hand and wipe the face with the other.

In `hold_and_wipe.yaml` beside this file, goals name their arm, their tool, and the goal that the
other arm reaches at the same time.
"""

from __future__ import annotations

from pathlib import Path

import tcs

TASK = Path(__file__).resolve().parent / "hold_and_wipe.yaml"


def main() -> None:
    """Score the pairs of goals, and re-check them with Drake, both arms posed at once."""
    file = tcs.score(TASK, environment="wheelchair", only=("torso = 0.15 m",))
    found = tcs.summary(file)
    print(f"by both arms from one base pose: {found['best_single']['reachability']:.0%}")
    alone = found["reasons"]["other_goal_unreached"]
    print(f"{alone:,} pairs of base pose and goal are reached by one arm, but not by the other")
    checked = tcs.verify(file, pairs=20, dense=0)
    print(f"{checked.checked} re-checked, {checked.false_reached} false")


if __name__ == "__main__":
    main()
