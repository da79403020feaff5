"""Motions of the arm at one base pose: certified curves, a bidirectional planner, straight motions.

In: a scene as arrays, prepared for one initial configuration (`scene`), postures and tool
directions. Out: joint paths along which nothing touches, between the samples too, or the pair of
shapes that blocks them. Nothing here is compiled before a motion is requested: scoring without
approach does not import this package.
"""
