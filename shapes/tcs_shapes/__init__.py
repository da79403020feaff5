"""Shapes of robots: what is done once for a robot, or for a mesh, before anything is scored.

In: a URDF, its meshes, and robot files. Out: boxes and capsules that enclose meshes
(`tcs_shapes.bodies`), pairs of bodies that need no check (`tcs_shapes.disabled_pairs`), measured
tables of distances (`tcs_shapes.measured_distances`), drafts of robot files (`tcs_shapes.draft`)
and their check-up (`tcs_shapes.checkup`).
"""
