"""Compiled scoring: kinematics, inverse kinematics, collision checks, dexterity and sets.

In: a scene, its goals and its grid as arrays (`arrays`). Out: arrays of scores (`scores`). Nothing
here imports Drake or reads files; modules that hold only layouts and names do not load numba.
"""
