"""Control of a teleoperated arm: end-effector, null-space and assisted control, step by step.

In: an `Arm`, `Settings` and one `Command` per control period. Out: joint rates within position,
velocity and acceleration limits, and the resulting `Step`. Entry point: `session.Teleoperation`.
"""
