"""Arms with a closed-form inverse: samples of the free joint, solved in batches.

In: a goal pose in the arm base frame and the arm's solver constants. Out: candidate joint angles,
and the best collision-free one.
"""
