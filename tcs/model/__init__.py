"""The model: robots, scenes, tasks and the grid of initial configurations.

In: YAML, URDF and SDF files. Out: checked values, a live Drake plant, and that plant lowered to the
arrays that the kernel reads.
"""
