"""Where to stand for the hand alone, whatever is around it: a capability map.

A map holds the base poses from which one pose of the tool is reached. Maps of all tool poses of a
task are merged, and the best base pose of the result is where to stand.
"""

from __future__ import annotations

import math
from pathlib import Path

from tcs.capability import (
    MapGrid,
    Reach,
    load_map,
    map_from_ik,
    merge,
    pick_and_place_task,
    save_map,
)
from tcs.model.robots import load_robot


def main(folder: Path = Path("out/examples")) -> None:
    """Make a map of TIAGo, keep it, and merge it for picking a cup and putting it down."""
    folder.mkdir(parents=True, exist_ok=True)
    # Steps of 10 cm and 45 deg are coarse, so that this is quick; 5 cm and 22.5 deg are usual.
    grid = MapGrid.of(step=0.1, yaw_bins=8, grasps="side")
    # Robot and grid have the same step, for the map counts torso heights in it too.
    reach = Reach(load_robot("tiago"), torso_height=0.15, step=0.1)
    path = folder / "tiago.tcm"
    save_map(path, map_from_ik(reach, grid))

    # Two positions 20 cm apart, 0.6 m above the floor; the origin is the first of them.
    task = pick_and_place_task(0.2, 0.6, step=grid.step)
    found = merge(load_map(path), task)
    best = found.best()
    print(f"{len(found.base_poses)} base poses reach both positions; the best one is")
    print(f"  x {best.x:.2f} m, y {best.y:.2f} m, heading {math.degrees(best.yaw):.0f} deg,")
    print(f"  torso height {best.torso_height:.2f} m, score {best.score:.2f}")


if __name__ == "__main__":
    main()
