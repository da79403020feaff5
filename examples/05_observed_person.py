"""Select a set for the observed position of a person on the bed.

The position of the person across the bed is observed, not chosen. A score file of the bed holds
scores for several shifts, and the nearest one is used. The observation is the value of a joint, or
the position of a body frame.
"""

from __future__ import annotations

import math
from pathlib import Path

import tcs

FOLDER = Path(__file__).resolve().parent


def main() -> None:
    """Score scratching on the bed for three shifts of the person, and select for observed ones."""
    file = tcs.score("scratching_upper_arm_left", environment=FOLDER / "small_bed.yaml")
    here = tcs.InitialConfiguration(base_x=1.0, base_y=1.4, base_yaw=-math.pi / 2, torso=0.0)

    for observed in ({"person_y": 0.0}, {"person_y": 0.08}):
        choice = tcs.select(file, here, observed=observed)
        # The table that was used; selection from a file always has one.
        assert choice.match is not None
        print(f"observed {observed}, used {choice.match.state}: {choice.members[0].to_json()}")

    # The same with the head's position from a camera [m], with the bed low and flat.
    choice = tcs.select(file, here, frames={"head": (0.294, -0.09, 0.682)})
    match = choice.match
    assert match is not None
    error = match.frame_position_error
    print(f"the head is {error:.3f} m from its position at the shift {match.state}")


if __name__ == "__main__":
    main()
