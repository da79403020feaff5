"""Compiled scoring: kinematics, inverse kinematics, collision checks, dexterity and sets.

In: a scene, its goals and its grid as arrays (`arrays`). Out: arrays of scores (`scores`). No
module here imports Drake, only `cache` accesses files, and modules that only define layouts and
names do not load numba.
"""
