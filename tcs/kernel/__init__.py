"""The kernel: arrays in, arrays out, compiled by numba, knowing nothing of Drake or files.

Its modules are imported one by one: `arrays` needs no compiler, and whoever only wants the
layout of the arrays should not have to load one.
"""
