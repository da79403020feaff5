"""Ask what is left of an answer when the room is a little off, and choose by that.

The chair, the person and the head are moved by random errors, a few centimetres and degrees, and
the goals are counted that are still reached.
"""

from __future__ import annotations

import math

import tcs


def main() -> None:
    """Evaluate feeding, estimate the success of the best sets, and choose with it."""
    file = tcs.score("feeding")

    # The best single place and the best set, in 100 rooms that are a little off. Same seed, same
    # rooms.
    for select in ("single", "best"):
        found = tcs.evaluate(file, select=select, samples=100, seed=0)
        interval = found.summary.ci95
        assert interval is not None  # Only a single sample has none.
        low, high = interval
        print(f"{select}: {found.summary.mean:.1%} (95 % between {low:.1%} and {high:.1%})")

    # Estimates for the best sets. `success` is the weight of the estimate's lower end, delta.
    file = tcs.robustify(file, sets=20, samples=64, seed=0)
    here = tcs.InitialConfiguration(base_x=2.0, base_y=-1.0, base_yaw=math.pi, torso=0.0)
    choice = tcs.select(file, here, weights=tcs.UtilityWeights(success=1.0))
    print(f"chosen by success too: {choice.success:.1%} estimated for it")
    for number in choice.order:
        print("  ", choice.members[number].to_json())


if __name__ == "__main__":
    main()
