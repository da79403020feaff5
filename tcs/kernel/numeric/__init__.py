"""Arms without a closed form: self-motion curves, traced from solutions found by Newton's method.

In: a goal pose in the arm base frame and the constants of the arm. Out: candidate joint angles
along the curves, and the best collision-free solution.
"""
