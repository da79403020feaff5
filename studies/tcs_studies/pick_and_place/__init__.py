"""Pick-and-place by teleoperation from several base poses: the experiment of the ITCM thesis.

In: a robot with a head camera, base poses, and scripted operators (numbers and seed). Out: for each
base pose and operator the repetitions with their measures, and the thesis's statistics.
`task` holds the table, `cup` the rules of contact, `view` the camera, `slave` the arm, `master` the
hand, `phases` and `operator` the operator, `repetition` one performance of the task and its
measures, `protocol` the experiment and `analysis` its statistics.

It is kinematic: the arm is `tcs.teleop.Teleoperation`, the cup follows rules, the table is a plane.
"""
