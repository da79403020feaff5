"""Approachable postures of reached pairs.

In: a scored problem, its reached pairs, and the straight tool motion that ends at each goal. Out:
for each pair the best posture from which the arm leaves backwards along that line, or the reason
why there is none. Nothing here is compiled before an approach is requested.
"""
