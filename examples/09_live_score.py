"""Score the room as it is found, in place of taking the nearest state that was scored.

The scene is built once; each observation then costs the scoring alone, which is quick enough to do
when the robot comes in and sees the person.
"""

from __future__ import annotations

import math
import time

import tcs


def main() -> None:
    """Score feeding for two observations of the room."""
    scorer = tcs.LiveScorer("feeding", "wheelchair")
    here = tcs.InitialConfiguration(base_x=2.0, base_y=-1.0, base_yaw=math.pi, torso=0.0)
    observations: dict[str, tcs.Observation | dict[str, float]] = {
        # The person sits 4 cm further forward than expected: person_x counts backward [m].
        "told by a joint": {"person_x": -0.04},
        # A camera sees the head; which joints explain that is found by least squares.
        "seen by a camera": tcs.Observation(frames={"head": (0.47, 0.02, 1.23)}),
    }
    for how, observation in observations.items():
        begun = time.perf_counter()
        file = scorer.score(observation)
        choice = tcs.select(file, here)
        seconds = time.perf_counter() - begun
        print(
            f"{how}: {choice.reachability:.0%} of the goals, scored and chosen in {seconds:.1f} s"
        )
        print("  ", [member.to_json() for member in choice.members])


if __name__ == "__main__":
    main()
