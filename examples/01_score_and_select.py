"""Score a task once, save the scores, and select base poses from the file.

Scoring evaluates every base pose and torso height of a grid. Selection reads the stored sets and
takes milliseconds; it needs neither simulator nor compiler.
"""

from __future__ import annotations

import math
from pathlib import Path

import tcs


def main(folder: Path = Path("out/examples")) -> None:
    """Score feeding in the wheelchair and select for two current base poses."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "feeding.tcs"

    # Offline: 89,304 initial configurations x 7 goals, in about a second.
    tcs.save(path, tcs.score("feeding", environment="wheelchair", robot="pr2"))

    # Online: the current base pose, x and y [m] and yaw [rad] in the environment frame;
    # `tcs list` describes its origin.
    file = tcs.load(path)
    for x, y in [(2.0, 1.0), (2.0, -1.0)]:
        here = tcs.InitialConfiguration(base_x=x, base_y=y, base_yaw=math.pi, torso=0.0)
        choice = tcs.select(file, here, weights=tcs.UtilityWeights(travel=0.05))
        print(f"from x {x:g} m, y {y:g} m, reaching {choice.reachability:.0%} of the goals:")
        # A set may have one member or two; `order` is the order in which to visit them.
        for number in choice.order:
            print("  ", choice.members[number].to_json())


if __name__ == "__main__":
    main()
