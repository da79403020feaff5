"""Scripted operators: repeatable models of people who teleoperate an arm.

In: the line to follow, operator traits and the steps of the arm so far. Out: one `Command` per
control period.
"""
