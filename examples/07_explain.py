"""Explain why goals are not reached from a base pose, and the cheapest changes that reach them.

A score file keeps a reason for each configuration and goal that is not reached; nothing is
computed again.
"""

from __future__ import annotations

import math

import tcs


def main() -> None:
    """Explain every goal of feeding from one configuration."""
    # With one heading of the base, to be quick.
    file = tcs.score("feeding", only=("base_yaw = 180 deg",))
    here = tcs.InitialConfiguration(base_x=1.1, base_y=0.7, base_yaw=math.pi, torso=0.0)
    for goal in range(len(file.task["goals"])):
        found = tcs.explain(file, goal, here)
        explained = found.explained
        assert explained is not None  # It is None only if no configuration is given.
        line = f"goal {goal + 1}: {explained.reason.name.lower()}"
        if explained.pair is not None:
            line += f", {explained.pair[0]} would touch {explained.pair[1]}"
        # The cheapest change to a configuration that reaches the goal, as a sentence.
        if not explained.is_reached and found.fix is not None:
            line += f". {found.fix.sentence}"
        print(line)


if __name__ == "__main__":
    main()
