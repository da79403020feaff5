"""Let the person turn the head.

`wheelchair_head_turn.yaml` beside this file makes the turn of the head an axis of the grid, like
the head rest of the bed: an answer then says how far the person should turn it.
"""

from __future__ import annotations

from pathlib import Path

import tcs

TURNING = Path(__file__).resolve().parent / "wheelchair_head_turn.yaml"


def main() -> None:
    """Shave from one base pose at the person's left, with the head straight and turned."""
    left = ("base_x = 0..1.2 m", "base_y = 0.4..1.2 m", "base_yaw = 180..315 deg")
    for allowed in ("head_turn = 0 deg", "head_turn = -60..60 deg"):
        file = tcs.score("shaving", environment=TURNING, only=(*left, allowed))
        best = tcs.summary(file)["best_single"]
        print(f"{allowed}: {best['reachability']:.0%} of the goals from {best['members'][0]}")


if __name__ == "__main__":
    main()
