"""Placement: initial configurations for a task, by the method of the TCS paper.

In: a task, an environment and a robot. Out: a score for every configuration and goal, the stored
sets of configurations, the best set for the current state, and its success under pose error.
"""
