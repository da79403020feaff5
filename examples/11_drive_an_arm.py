"""Teleoperate a seven-joint arm to a joint limit, leave it by null-space motion, and continue.

An arm with seven joints can move while the tool is held, which moves a joint away from its limit.
Everything is simulated; nothing is sent to a robot.
"""

from __future__ import annotations

import numpy as np

from tcs.teleop import Command, Mode, Settings, Step, Teleoperation, load_arm

UP = Command(linear=(0.0, 0.0, 0.1), mode=Mode.END_EFFECTOR)
"""The tool straight up at 10 cm/s."""


def drive_up(session: Teleoperation) -> Step:
    """Move the tool up until the arm stops, and print the reason; one step is 10 ms."""
    step = session.step(UP)
    while not step.stopped:
        step = session.step(UP)
    print(f"{step.time:.1f} s, {step.p[2]:.2f} m up: {step.reason}")
    return step


def main() -> None:
    """Move the tool of an iiwa up, move joints 2, 4 and 6 in its null space, and continue."""
    # "paper": a motion ends at the first joint limit. By default the other joints continue.
    settings = Settings(limits="paper")
    session = Teleoperation(load_arm("iiwa7"), [0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0], settings)
    drive_up(session)

    # Let the arm come to rest, then move its second joint group for a second and a half.
    for _ in range(50):
        before = session.step(Command())
    for _ in range(150):
        after = session.step(Command(mode=Mode.NULL_SPACE, group=1, sign=-1))
    drift = 1000.0 * np.linalg.norm(after.p - before.p)
    moved = np.degrees(after.joints - before.joints)
    print(f"joints moved by {np.round(moved).astype(int).tolist()} deg, the tool by {drift:.3f} mm")

    drive_up(session)


if __name__ == "__main__":
    main()
