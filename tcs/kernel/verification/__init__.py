"""What the kernel is checked against: the plain-loop reference and the dense scans.

In: the same arrays as the kernel. Out: the same answers, computed slowly and independently. Only
tests and `tcs.placement.scoring.verify` use it.
"""
