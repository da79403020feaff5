"""The trajectory-following experiment of the null-space paper with scripted operators.

In: an arm, a line that needs null-space motion (`course`) and an experiment plan. Out: trials with
their metrics, the paper's statistics, and the capability map of each controller.
"""
