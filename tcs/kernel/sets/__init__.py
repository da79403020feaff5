"""Sets of two or three configurations with a high P_R and P_M.

In: dexterity of the candidates at every goal, grouped by base cell, and the thresholds for a set
to be kept. Out: the kept pairs per cell pair, or the kept triples.
"""
