"""Cover a part of the body with goals.

`washing_torso.yaml` beside this file names no goals, but a surface: they are made on the person of
the environment, wherever the trunk is exposed.
"""

from __future__ import annotations

from pathlib import Path

import tcs

WASHING = Path(__file__).resolve().parent / "washing_torso.yaml"


def main() -> None:
    """Wash the trunk in the wheelchair."""
    file = tcs.score(WASHING, environment="wheelchair", only=("torso = 0.15 m",))
    found = tcs.summary(file)
    print(f"{found['goals']} goals, 0.1 m apart")
    print(f"reached from one base pose: {found['best_single']['reachability']:.0%}")
    print(f"reached from two: {found['best']['reachability']:.0%}")


if __name__ == "__main__":
    main()
