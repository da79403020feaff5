"""Choose for a person who lies where they lie.

Where the person lies across the bed is found, not chosen. A file of the bed holds scores for
several such shifts, and the nearest one is used. It may be told by a joint's value, or by where a
part of the body is seen.
"""

from __future__ import annotations

import math
from pathlib import Path

import tcs

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Score scratching on the bed for three shifts of the person, and choose for what is seen."""
    file = tcs.score("scratching_upper_arm_left", environment=HERE / "small_bed.yaml")
    here = tcs.InitialConfiguration(base_x=1.0, base_y=1.4, base_yaw=-math.pi / 2, torso=0.0)

    for told in ({"person_y": 0.0}, {"person_y": 0.08}):
        choice = tcs.select(file, here, observed=told)
        # Which of the scored shifts was used, and how far what was told is off it.
        assert choice.match is not None  # Chosen from a file, there is always one.
        print(f"told {told}, used {choice.match.state}: {choice.members[0].to_json()}")

    # The same from a camera: the head's place in the room's frame [m], with the bed low and flat.
    choice = tcs.select(file, here, frames={"head": (0.294, -0.09, 0.682)})
    match = choice.match
    assert match is not None
    print(f"seen {match.frame_error:.3f} m from where it is at the shift {match.state}")


if __name__ == "__main__":
    main()
