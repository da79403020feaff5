"""The engine as a node of ROS 1 or of ROS 2: every request by name, and where to stand, from tf.

In: an engine, and transforms between the environment, the robot's base and frames of the person.
Out: services of the types in `ros/tcs_msgs`, which answer with base poses, torso heights, states of
the environment and trajectories. ROS is imported only when a node is made: ROS 1 comes with the
system, and ROS 2 need not be installed.
"""

from __future__ import annotations

from tcs.service.ros.frames import FrameNames, Pose, TransformTree
from tcs.service.ros.placing import PlacedRobot, PlacedStop, Placer, PlaceRequest, Trajectory

__all__ = [
    "FrameNames",
    "PlaceRequest",
    "PlacedRobot",
    "PlacedStop",
    "Placer",
    "Pose",
    "Trajectory",
    "TransformTree",
]
