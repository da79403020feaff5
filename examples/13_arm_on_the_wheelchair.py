"""Bolt an arm to the wheelchair.

`wheelchair_rails.yaml` beside this file mounts the robot on rails beside the seat: the grid is over
places on the rails instead of places on the floor. The answer says where to bolt the arm.
"""

from __future__ import annotations

from pathlib import Path

import tcs

RAILS = Path(__file__).resolve().parent / "wheelchair_rails.yaml"


def main() -> None:
    """Feed with a Kinova Jaco from the right rail."""
    right = ("base_x = 0.4..0.7 m", "base_y = -0.36 m")
    file = tcs.score("feeding", environment=RAILS, robot="jaco", only=right)
    best = tcs.summary(file)["best_single"]
    mount = best["members"][0]
    print(
        f"{best['reachability']:.0%} of the goals with the arm {mount['base_x']:.2f} m "
        f"ahead of the rear of the wheels, turned by {mount['base_yaw_deg']:.0f} deg"
    )


if __name__ == "__main__":
    main()
