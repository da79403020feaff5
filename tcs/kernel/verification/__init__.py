"""Checks of the kernel: the plain-loop reference implementation and the dense scans.

In: the arrays that the kernel reads. Out: the same results, computed slowly and independently.
Tests, benchmarks and `tcs.placement.scoring.verify` use this package.
"""
