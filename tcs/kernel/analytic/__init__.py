"""Arms with closed-form inverse kinematics: samples of the free joint, solved in batches.

In: a goal pose in the arm base frame and the constants of the closed form. Out: candidate joint
angles, and the best collision-free solution.
"""
