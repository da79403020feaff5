"""Ask why a goal is not reached from where the robot stands, and what would help.

Each pair of configuration and goal that is not reached keeps its reason. Nothing is solved anew.
"""

from __future__ import annotations

import math

import tcs


def main() -> None:
    """Explain every goal of feeding from one place."""
    file = tcs.score("feeding")
    here = tcs.InitialConfiguration(base_x=1.1, base_y=0.7, base_yaw=math.pi, torso=0.0)
    for goal in range(len(file.task["goals"])):
        found = tcs.explain(file, goal, here)
        standing = found.standing
        assert standing is not None  # There is always one where a place is named.
        line = f"goal {goal}: {standing.reason.name.lower()}"
        if standing.pair is not None:
            line += f", {standing.pair[0]} would touch {standing.pair[1]}"
        # The least change from which it is reached, in words.
        if not standing.is_reached and found.fix is not None:
            line += f". {found.fix.sentence}"
        print(line)


if __name__ == "__main__":
    main()
