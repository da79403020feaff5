"""Presentation: one place where results become words, pictures, pages and views.

In: results of placement, capability maps and teleoperation. Out: text, matplotlib figures,
self-contained pages and Meshcat scenes, shared by every surface.
"""
