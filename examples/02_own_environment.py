"""Put furniture into the room, and see what it leaves.

`kitchen.yaml` beside this file is a room of its own in eight lines: the wheelchair's room with a
table and a lamp. Wherever the name of a room goes, the path of such a file may go as well.
"""

from __future__ import annotations

from pathlib import Path

import tcs

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Score feeding with and without the furniture."""
    for room in ("wheelchair", HERE / "kitchen.yaml"):
        file = tcs.score("feeding", environment=room)
        # What was scored, as plain numbers: the same that `tcs score --json` prints.
        found = tcs.summary(file)
        print(f"{file.environment['name']}:")
        print(f"  {found['reasons']['reached']:,} pairs of configuration and goal are reached,")
        print(f"  {found['reasons']['body_blocked']:,} are not, for there the base has no room.")
        print(f"  Best place to stand: {found['best_single']['members']}")


if __name__ == "__main__":
    main()
