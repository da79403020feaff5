"""Which collisions of the robot's body count when the environment is perturbed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pydrake.multibody.tree import RevoluteJoint, WeldJoint

from tcs.errors import UnknownNameError
from tcs.kernel.arrays import BoolArray
from tcs.model.scene import LoweredScene, Scene
from tcs.placement.store import PAPER

BODY_COLLISIONS = ("all", "paper", "none")
"""Collisions of the robot at rest, its body and the scored arm, with the environment:

- `all`: all of them, with the distances that the robot keeps.
- `paper`: all but those of the base with the furniture, which the evaluation of the TCS paper
  ignores: the base may touch a wheelchair that stands elsewhere than assumed.
- `none`: none of them, as in hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD), 30 April 2015.
"""


def default_collisions(metadata: Mapping[str, Any]) -> str:
    """Return the collisions that count unless others are requested, one of `BODY_COLLISIONS`.

    Args:
        metadata: The metadata of a score file, or the record of what a plan was made from.
    """
    return "paper" if metadata.get(PAPER) is True else "all"


def check_body_collisions(name: str) -> None:
    """Refuse a name that is not one of `BODY_COLLISIONS`.

    Raises:
        UnknownNameError: If it is not.
    """
    if name not in BODY_COLLISIONS:
        raise UnknownNameError("body collisions", name, BODY_COLLISIONS)


def counted_pairs(scene: Scene, lowered: LoweredScene, body_collisions: str) -> BoolArray:
    """Return which pairs of a body shape and an environment shape are checked under error.

    Args:
        scene: The scene, for the bodies that belong to the base and to the person.
        lowered: The same scene as arrays.
        body_collisions: One of `BODY_COLLISIONS`.

    Returns:
        Shape (body shapes, environment shapes); never more pairs than in the offline score.

    Source:
        TCS section IV: "We ignore collisions between the robot base and the wheelchair".
    """
    arrays = lowered.arrays
    pairs = arrays.body_vs_environment.copy()
    if body_collisions == "none":
        pairs[:] = False
    if body_collisions == "paper":
        base, spec = base_bodies(scene), scene.spec.environment
        of_base = [lowered.robot_bodies[i] in base for i in arrays.body.body]
        models = [lowered.environment_bodies[i].split("::")[0] for i in arrays.environment.body]
        for column, model in enumerate(models):
            if not spec.is_person(model):
                pairs[of_base, column] = False
    return pairs


def counted_rests(lowered: LoweredScene, body_collisions: str) -> LoweredScene:
    """Return a scene whose arm at rest is checked only if collisions of the body count at all."""
    if body_collisions != "none":
        return lowered
    return replace(lowered, arrays=lowered.arrays._replace(rest=np.empty((0, 7))))


def base_bodies(scene: Scene) -> frozenset[str]:
    """Return the names of the robot bodies that form its base.

    They are the root body and what is fixed to it or turns on it without limits: wheels and
    casters. Whatever hangs on a joint with limits belongs to torso, head or arms.
    """
    plant = scene.built.plant
    root = scene.built.base_frame.body()
    found = {root.index()}
    joints = [plant.get_joint(i) for i in plant.GetJointIndices(root.model_instance())]
    # A body's joint may be listed before that of its parent: repeat until nothing is added.
    size = 0
    while len(found) > size:
        size = len(found)
        for joint in joints:
            is_wheel = isinstance(joint, RevoluteJoint) and not _is_limited(joint)
            if isinstance(joint, WeldJoint) or is_wheel:
                if joint.parent_body().index() in found:
                    found.add(joint.child_body().index())
    return frozenset(plant.get_body(index).name() for index in found)


def _is_limited(joint: RevoluteJoint) -> bool:
    return bool(joint.position_lower_limits()[0] > -float("inf"))
