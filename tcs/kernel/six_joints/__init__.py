"""Arms of six joints: a goal has at most sixteen solutions, and all are found.

In: a goal pose in the arm base frame and the constants of the arm. Out: all its solutions, and the
best one within the joint limits that is free of contact. No joint is free, so nothing is sampled.

The chain of such an arm begins with a joint that remains at 0 (`tcs.kernel.arrays.Chain`), so the
joints 1 to 6 of the arm are the joints 2 to 7 of the chain.
"""
