"""What `tcs verify` checks results with: dense scans, and dexterity by its definition.

In: the arrays that the kernel reads. Out: the same results, computed slowly and independently.
The plain-loop reference of all that the kernel does is in `tests/reference`.
"""
