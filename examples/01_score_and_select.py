"""Score a task once, keep the scores in a file, and choose from it where to stand.

Scoring looks at every place, heading and torso height of a grid. Choosing reads what was stored and
takes milliseconds: neither simulator nor compiler is needed for it.
"""

from __future__ import annotations

import math
from pathlib import Path

import tcs


def main(folder: Path = Path("out/examples")) -> None:
    """Score feeding in the wheelchair and choose for two places where the robot may be."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "feeding.tcs"

    # The offline part: 89,304 initial configurations x 7 goals, in about a second.
    tcs.save(path, tcs.score("feeding", environment="wheelchair", robot="pr2"))

    # The online part: where is the robot now? x and y [m] and heading [rad] in the room's frame;
    # `tcs list` says where its origin is.
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
