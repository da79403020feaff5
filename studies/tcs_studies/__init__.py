"""The experiments of the papers: with scripted operators, with people, and under error.

In: the arm of `tcs.teleop`, the score files of `tcs.placement`. Out: runs, measures, tests, tables
and pages. `operators` are scripted; `experiment` is that of the null-space paper, `pick_and_place`
that of the ITCM thesis, `study` either with people, and `robustness` that behind Tables I and III
of the TCS paper. `output` presents them.
"""
