"""Placement: where the robot should stand, after the TCS paper.

In: a task, an environment and a robot. Out: a score for every configuration and goal, the sets of
configurations worth using, the set to use now, and how robust it is under pose error.
"""
