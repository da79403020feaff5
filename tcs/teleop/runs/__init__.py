"""Runs: recorded commands and steps of a teleoperated arm, and their files.

In: each command with the step that it led to (`recorder`). Out: a `Run`, written to and read from
CSV.
"""
