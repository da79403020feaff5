"""Evaluate the success of a set in perturbed environments, and select by success.

The chair, the person and the head are displaced by random errors of a few centimetres and degrees,
and the goals that are still reached are counted.
"""

from __future__ import annotations

import math

import tcs


def main() -> None:
    """Evaluate feeding, estimate the success of the best sets, and select by it."""
    # At one height of the torso, to be quick.
    file = tcs.score("feeding", only=("torso = 0.3 m",))

    # The best single configuration and the best set, on the same 100 samples of errors.
    for select in ("single", "best"):
        found = tcs.evaluate(file, select=select, samples=100, seed=0)
        interval = found.summary.ci95
        assert interval is not None  # Only a single sample has none.
        low, high = interval
        print(f"{select}: {found.summary.mean:.1%} (95 % interval {low:.1%} to {high:.1%})")

    # Estimates for the best sets. `success`, delta, weighs their lower confidence bound.
    file = tcs.robustify(file, sets=20, samples=64, seed=0)
    here = tcs.InitialConfiguration(base_x=2.0, base_y=-1.0, base_yaw=math.pi, torso=0.0)
    choice = tcs.select(file, here, weights=tcs.UtilityWeights(success=1.0))
    print(f"selected by success: {choice.success:.1%} estimated")
    for number in choice.order:
        print("  ", choice.members[number].to_json())


if __name__ == "__main__":
    main()
