"""Score an environment of your own.

`kitchen.yaml` beside this file is an environment in eight lines: the wheelchair with a table and a
lamp. The path of such a file can be given wherever the name of an environment can.
"""

from __future__ import annotations

from pathlib import Path

import tcs

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Score feeding with and without the furniture."""
    for environment in ("wheelchair", HERE / "kitchen.yaml"):
        file = tcs.score("feeding", environment=environment)
        # The scores as plain numbers: the same that `tcs score --json` prints.
        summary = tcs.summary(file)
        reasons = summary["reasons"]
        print(f"{file.environment['name']}:")
        print(f"  {reasons['reached']:,} pairs of configuration and goal are reached;")
        print(f"  in {reasons['body_blocked']:,} the robot's body would touch something.")
        print(f"  Best base pose: {summary['best_single']['members']}")


if __name__ == "__main__":
    main()
