"""Loops over cells and pieces of a surface, for the shapes that enclose it.

In: grids of cells, pieces of a surface, and shapes, as arrays. Out: distances on the grid, boxes
that grow on it, and what each shape contains.
"""
