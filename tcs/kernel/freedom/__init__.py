"""Goals with freedom: the best score over all tool poses that serve.

In: for each goal, which rotations and displacements of the tool serve as well as its nominal pose.
Out: the score of the best pose found. The poses of a goal are sampled once for all configurations;
each is solved as a goal of its own, and the best one is refined.
"""
