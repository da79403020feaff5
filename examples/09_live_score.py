"""Score the scene as it is observed, instead of using the nearest scored state.

The scene is built once; each observation then takes only the time of the scoring, which is short
enough for scoring when the robot has arrived and observes the person.
"""

from __future__ import annotations

import math
import time

import tcs


def main() -> None:
    """Score feeding for two observations of the environment."""
    # At one height of the torso, to be quick.
    scorer = tcs.LiveScorer("feeding", "wheelchair", only=("torso = 0.3 m",))
    here = tcs.InitialConfiguration(base_x=2.0, base_y=-1.0, base_yaw=math.pi, torso=0.0)
    observations: dict[str, tcs.Observation | dict[str, float]] = {
        # The person sits 4 cm further forward than expected: person_x points backward [m].
        "observed joint": {"person_x": -0.04},
        # A camera detects the head; the joints are fitted to its position by least squares.
        "observed frame": tcs.Observation(frames={"head": (0.47, 0.02, 1.23)}),
    }
    for source, observation in observations.items():
        begun = time.perf_counter()
        file = scorer.score(observation)
        choice = tcs.select(file, here)
        seconds = time.perf_counter() - begun
        print(
            f"{source}: {choice.reachability:.0%} of the goals, scored and selected in "
            f"{seconds:.1f} s"
        )
        print("  ", [member.to_json() for member in choice.members])


if __name__ == "__main__":
    main()
