"""Feed with an arm of five joints.

Five joints cannot put the tool at every pose, so the goals of `feeding_from_any_side.yaml` leave
the rotation about the vertical free. It is solved together with the joints. The arm stands on a
table before the wheelchair (`arm_on_the_table.yaml`).
"""

from __future__ import annotations

from pathlib import Path

import tcs

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Score an SO-101 on the table, and let Drake check it."""
    file = tcs.score(
        HERE / "feeding_from_any_side.yaml",
        environment=HERE / "arm_on_the_table.yaml",
        robot=HERE / "so101.yaml",
    )
    best = tcs.summary(file)["best_single"]
    place = best["members"][0]
    print(
        f"{best['reachability']:.0%} of the goals with the arm {place['base_x']:.2f} m ahead of "
        f"the rear of the wheels, turned by {place['base_yaw_deg']:.0f} deg"
    )
    found = tcs.verify(file, pairs=100, dense=20)
    print(
        f"{found.checked} re-checked with Drake, {found.false_reached} false; "
        f"{found.dense_checked} unreached ones scanned, {found.missed} missed"
    )


if __name__ == "__main__":
    main()
