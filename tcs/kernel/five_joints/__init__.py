"""Arms of five joints: the rotation that a goal leaves free stands in for the sixth joint.

In: a tool pose, an axis of the tool about which its rotation is free, and the constants of the arm.
Out: every posture that puts the tool there at any angle about the axis, and the best one within the
joint limits that is free of contact.

The arm and a joint about that axis, behind the tool, are an arm of six joints (`turned_chain`),
which `tcs.kernel.six_joints` solves: the angle is found with the joints, and none is sampled. That
joint has no limits, carries no shapes and does not count in the dexterity.

The chain of such an arm begins with two joints that remain at 0 (`tcs.kernel.arrays.Chain`), so the
joints 1 to 5 of the arm are the joints 3 to 7 of the chain.
"""
