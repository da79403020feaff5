"""Make a capability map of a robot, and find the best base pose for pick and place.

A map holds the base poses from which one tool pose is reached, without furniture. The maps of all
tool poses of a task are merged; the result has the base poses that reach all of them.
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
    """Make a map of TIAGo, save it, and merge it for a pick-and-place task."""
    folder.mkdir(parents=True, exist_ok=True)
    # A coarse grid of 10 cm and 45 deg is fast; the default is 5 cm and 22.5 deg.
    grid = MapGrid.of(step=0.1, yaw_bins=8, grasps="side")
    # Torso heights have the step of the grid.
    reach = Reach(load_robot("tiago"), torso_height=0.15, step=0.1)
    path = folder / "tiago.tcm"
    save_map(path, map_from_ik(reach, grid))

    # Two positions 20 cm apart, 0.6 m above the floor; the first is the origin.
    task = pick_and_place_task(0.2, 0.6, step=grid.step)
    found = merge(load_map(path), task)
    best = found.best()
    print(f"{len(found.base_poses)} base poses reach both positions; the best is")
    print(f"  x {best.x:.2f} m, y {best.y:.2f} m, heading {math.degrees(best.yaw):.0f} deg,")
    print(f"  torso height {best.torso_height:.2f} m, score {best.score:.2f}")


if __name__ == "__main__":
    main()
