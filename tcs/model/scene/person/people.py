"""Many people in one scene as arrays, without a Drake plant for each.

On a resized person every link keeps the orientation that it has on the papers' man; sizes of
shapes, positions of joints, padding and goals differ. The poses of his links are read from Drake,
and the differences are added: what a link moves by beyond the link that carries it is constant in
the frame of the latter.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import RigidBody

from tcs.errors import EnvironmentFileError
from tcs.kernel.arrays import FloatArray, IntArray, SceneArrays
from tcs.model.people import Scale
from tcs.model.scene.contacts import Group
from tcs.model.scene.lowered_scene import LoweredScene
from tcs.model.scene.lowering import environment_at
from tcs.model.scene.person.articulated import links_at_joints
from tcs.model.scene.person.goals import Anchor
from tcs.model.scene.person.joints import reference_poses
from tcs.model.scene.person.resized import (
    PARENTS,
    ROOT,
    Poses,
    covers_of,
    motion_to_support,
    numbers_of_parts,
    padding_of,
    person_shapes,
    poses_in_file,
    scales_by_link,
    steps_of_joints,
)
from tcs.model.scene.person.shapes import LinkShape
from tcs.model.scene.scene import Scene
from tcs.model.tasks import Task

_LINKS = (ROOT, *PARENTS)
"""The links of a person, each after its parent."""
_SAME_ORIGIN: Mapping[str, str] = {
    "head_link": ROOT,
    "head_turn_link": ROOT,
    "neck_rotation": "neck_link",
    **links_at_joints(),
}
"""Links without shapes at the origin of a link that moves with the size of the person."""


class _PartOfLink(NamedTuple):
    """A shape of the person among those of the environment."""

    row: int
    """Its number among the shapes of the environment."""
    link: int
    """Number of its link in `_LINKS`."""
    shape: int
    """Its number among the shapes of the link, of other people than the papers' man."""
    of_man: int
    """Number of the shape among those of the link of the papers' man."""


class _LinkPoses(NamedTuple):
    """Links of the papers' man in S states."""

    R: FloatArray
    """Orientations in M, the frame of the base poses, shape (S, links, 3, 3)."""
    p: FloatArray
    """Origins in M [m], shape (S, links, 3)."""
    turn: FloatArray
    """Rotation from the model frame with all joints at 0 to M, of what carries each node,
    shape (S, nodes, 3, 3)."""


class _Node(NamedTuple):
    """A body of the person that moves with their size, or one at its origin."""

    name: str
    link: int
    """Number in `_LINKS` of the link whose origin it shares."""
    above: int
    """Number of the node that carries it; -1 if what carries it does not move with the size."""


class PeopleInScene:
    """The environment of a scene in several states, in which the person may have any body."""

    def __init__(
        self,
        lowered: LoweredScene,
        scene: Scene,
        task: Task,
        states: Sequence[Mapping[str, float]],
    ) -> None:
        """Read the scene of the papers' man.

        Args:
            lowered: The scene as arrays.
            scene: The scene itself, its person not resized; its state is restored.
            task: The goals on the papers' man.
            states: Positions of the environment's joints by name [m or rad], for each of S states.

        Raises:
            EnvironmentFileError: If there is no person that can be resized.
            TcsError: If a joint cannot take a position.
        """
        self._environment = environment = scene.spec.environment
        bodies = _person_bodies(scene)
        self._names = tuple(f"{environment.person_model}::{link}" for link in _LINKS)
        self._arrays = environment_at(lowered, scene, task, states)
        shapes = person_shapes(environment)
        self._shapes = {link: shapes[self._names[i]] for i, link in enumerate(_LINKS)}
        self._before = poses_in_file(environment)
        self._at_zero, articulated = reference_poses(environment)
        carriers = _carriers(scene, bodies)
        self._nodes = _nodes(carriers)
        self._base = _base(carriers)
        self._poses = self._read_poses(scene, bodies, carriers, articulated, states)
        numbers = [
            numbers_of_parts(name, self._shapes[link])
            for link, name in zip(_LINKS, self._names, strict=True)
        ]
        self.rows, self._parts = _rows(
            _parts(scene, bodies), numbers, len(self._arrays.environment.pad)
        )
        """Number of the part of the papers' man's scene in each row of the environment, shape (n,):
        some of his shapes are several of other people."""
        self._anchors = self._read_anchors(task)

    def arrays_of(
        self, people: Sequence[Mapping[str, Scale]], states: IntArray
    ) -> list[SceneArrays]:
        """Return the arrays of some of the states with a person in them, for each of N people.

        They equal the lowering of the resized scene within a micrometre: the model files round
        orientations to seven digits, so that Drake's products of them are rotations to 1e-7 only.

        Args:
            people: How the parts of each person are stretched, by the keys of `LINKS` of
                `tcs.model.people`.
            states: Numbers of the states of each person, shape (N, s).
        """
        by_part = {part: np.array([one[part] for one in people]) for part in people[0]}
        of_names = scales_by_link(self._environment.person_model, by_part)
        of_links = {link: of_names[name] for link, name in zip(_LINKS, self._names, strict=True)}
        covers = {
            link: covers_of(self._environment, name, self._shapes[link], of_links[link])
            for link, name in zip(_LINKS, self._names, strict=True)
        }
        stretched = {
            link: list(itertools.chain.from_iterable(found)) for link, found in covers.items()
        }
        R, p = self._poses.R[states], self._origins(of_links, stretched, states)
        pads, before = self._paddings(of_names), self._paddings({})
        whole = self._arrays.environment
        sizes = np.repeat(whole.size[None, self.rows], len(people), axis=0)
        paddings = np.repeat(whole.pad[None, self.rows], len(people), axis=0)
        turned, centres = whole.R[states][:, :, self.rows], whole.p[states][:, :, self.rows]
        for part in self._parts:
            link = _LINKS[part.link]
            shape, of_man = stretched[link][part.shape], self._shapes[link][part.of_man]
            sizes[:, part.row, : shape.size.shape[-1]] = shape.size
            paddings[:, part.row] = pads[part.link]
            R_link, offset = R[:, :, part.link], shape.p_LoSo_L[:, None]
            centres[:, :, part.row] = p[:, :, part.link] + np.matvec(R_link, offset)
            # Where the orientation stays, the digits that Drake computed are kept.
            if shape.R_LS is not of_man.R_LS:
                is_turned = np.any(shape.R_LS != of_man.R_LS, axis=(-2, -1))
                turned[is_turned, :, part.row] = (R_link @ shape.R_LS[:, None])[is_turned]
        goal_p = self._arrays.goal_p[states]
        for pose, (on, anchor) in self._anchors.items():
            link = _LINKS[on]
            position = anchor.position(of_links[link], covers[link], pads[on] - before[on])
            goal_p[:, :, pose] = p[:, :, on] + np.matvec(R[:, :, on], position[:, None])
        arrays = self._arrays._replace(
            arm_vs_environment=self._arrays.arm_vs_environment[:, self.rows],
            body_vs_environment=self._arrays.body_vs_environment[:, self.rows],
        )
        environment = whole._replace(
            type=whole.type[self.rows], body=whole.body[self.rows], frame=whole.frame[self.rows]
        )
        return [
            arrays._replace(
                environment=environment._replace(
                    size=sizes[number], pad=paddings[number], R=turned[number], p=centres[number]
                ),
                goal_R=self._arrays.goal_R[states[number]],
                goal_p=goal_p[number],
            )
            for number in range(len(people))
        ]

    def _paddings(self, scales: Mapping[str, FloatArray]) -> list[FloatArray]:
        """Return the padding of each link [m]; of the papers' man without scales."""
        return [padding_of(self._environment, name, scales) for name in self._names]

    def _origins(
        self,
        scales: Mapping[str, FloatArray],
        stretched: Mapping[str, list[LinkShape]],
        states: IntArray,
    ) -> FloatArray:
        """Return the origins of the links of N people in M [m], shape (N, s, links, 3)."""
        moved = _moved(self._before, scales)
        after = {
            link: (R, p + moved[link]) for link, (R, p) in self._before.items() if link in moved
        }
        support = motion_to_support(self._before, self._shapes, after, stretched)
        # The support moves what carries the person.
        R_base = self._at_zero[self._base][0] @ self._before[self._base][0].T
        at_zero = _moved(self._at_zero, scales)
        by_size = [at_zero[link] + np.matvec(R_base, support) for link in _LINKS]
        motions: list[FloatArray] = []
        for number, node in enumerate(self._nodes):
            turn, step = self._poses.turn[states, number], by_size[node.link]
            if node.above < 0:
                motions.append(np.matvec(turn, step[:, None]))
                continue
            step = step - by_size[self._nodes[node.above].link]
            motions.append(motions[node.above] + np.matvec(turn, step[:, None]))
        names = [node.name for node in self._nodes]
        of_links = np.stack([motions[names.index(link)] for link in _LINKS], axis=2)
        return np.asarray(self._poses.p[states] + of_links)

    def _read_poses(
        self,
        scene: Scene,
        bodies: Mapping[str, RigidBody],
        carriers: Mapping[str, RigidBody],
        at_zero: Poses,
        states: Sequence[Mapping[str, float]],
    ) -> _LinkPoses:
        """Return the links of the papers' man in each state, read from Drake.

        Args:
            scene: The scene; its state is restored.
            bodies: The bodies of the person by name.
            carriers: What carries each of them.
            at_zero: Poses of all links in the model frame with the joints at 0.
            states: Positions of the joints, for each state.
        """
        links = [bodies[link] for link in _LINKS]
        above = [carriers[node.name] for node in self._nodes]
        reference = np.stack([at_zero[body.name()][0] for body in above])
        plant, context = scene.built.plant, scene.plant_context
        before, found = scene.positions(), []
        try:
            for state in states:
                for name, value in state.items():
                    scene.set_joint(name, value)
                poses = [plant.EvalBodyPoseInWorld(context, body) for body in (*links, *above)]
                found.append([X.GetAsMatrix34() for X in scene.seen_from_mount(poses)])
        finally:
            scene.restore(before)
        X = np.array(found).reshape(len(states), -1, 3, 4)
        of_links, of_carriers = X[:, : len(links)], X[:, len(links) :]
        turn = of_carriers[..., :3] @ np.swapaxes(reference, 1, 2)
        return _LinkPoses(R=of_links[..., :3], p=of_links[..., 3], turn=turn)

    def _read_anchors(self, task: Task) -> dict[int, tuple[int, Anchor]]:
        """Return number of the link, and anchor on it, of each pose of a goal on the person."""
        anchors = {}
        for number, pose in enumerate(task.poses):
            name = self._environment.body_frames[pose.body_frame]
            if name in self._names:
                link = self._names.index(name)
                anchors[number] = link, Anchor.of(pose, self._shapes[_LINKS[link]])
        return anchors


def _person_bodies(scene: Scene) -> dict[str, RigidBody]:
    """Return the bodies of the person by link.

    Raises:
        EnvironmentFileError: If there is no person that can be resized.
    """
    environment, plant = scene.spec.environment, scene.built.plant
    model, where = environment.person_model, f"environment '{environment.name}'"
    if not environment.is_person(model):
        raise EnvironmentFileError(f"{where} has no person to replace.")
    if environment.has_body:
        raise EnvironmentFileError(f"{where}: the person is resized already.")
    instance = plant.GetModelInstanceByName(model)
    bodies = {body.name(): body for body in map(plant.get_body, plant.GetBodyIndices(instance))}
    missing = [link for link in _LINKS if link not in bodies]
    if missing:
        raise EnvironmentFileError(
            f"{where}: '{model}' has no link '{missing[0]}', so that the person cannot be resized. "
            "Use person_seated.sdf or person_lying.sdf."
        )
    for entry in environment.models:
        if entry.parent.startswith(f"{model}::"):
            raise EnvironmentFileError(
                f"{where}: '{entry.name}' is fixed to the person, so that it is unknown where it "
                "is on other people. Fix it to the furniture."
            )
    return bodies


def _carriers(scene: Scene, bodies: Mapping[str, RigidBody]) -> dict[str, RigidBody]:
    """Return the body that the joint of each body of the person is fixed to."""
    plant = scene.built.plant
    return {
        joint.child_body().name(): joint.parent_body()
        for joint in map(plant.get_joint, plant.GetJointIndices(bodies[ROOT].model_instance()))
    }


def _nodes(carriers: Mapping[str, RigidBody]) -> tuple[_Node, ...]:
    """Return the bodies that move with the size of the person, each after what carries it."""
    found: dict[str, _Node] = {}

    def add(name: str) -> None:
        if name in found:
            return
        link = _SAME_ORIGIN.get(name, name)
        above = carriers[name].name()
        moves = above in _LINKS or above in _SAME_ORIGIN
        if moves:
            add(above)
        number = list(found).index(above) if moves else -1
        found[name] = _Node(name, _LINKS.index(link), number)

    for link in _LINKS:
        add(link)
    return tuple(found.values())


def _base(carriers: Mapping[str, RigidBody]) -> str:
    """Return the name of the link that carries the person whatever their size."""
    name = ROOT
    while name in _LINKS or name in _SAME_ORIGIN:
        name = carriers[name].name()
    return name


def _moved(before: Poses, scales: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Return how far each link moves from the head outward, in the model frame [m], (N, 3)."""
    moved = {ROOT: np.zeros(3)}
    for link, step in steps_of_joints(before, scales).items():
        moved[link] = moved[PARENTS[link]] + step
    return moved


def _parts(scene: Scene, bodies: Mapping[str, RigidBody]) -> list[_PartOfLink]:
    """Return the shapes of the person among those of the environment."""
    index = {bodies[link].index(): i for i, link in enumerate(_LINKS)}
    count = [0] * len(_LINKS)
    parts = []
    found = (part for part in scene.built.parts if part.group is Group.ENVIRONMENT)
    for row, part in enumerate(found):
        if part.body in index:
            link = index[part.body]
            parts.append(_PartOfLink(row, link, count[link], count[link]))
            count[link] += 1
    return parts


def _rows(
    parts: list[_PartOfLink], numbers: Sequence[Sequence[int]], count: int
) -> tuple[IntArray, list[_PartOfLink]]:
    """Return the rows of the environment with other people, and the parts of the person in them.

    Args:
        parts: The shapes of the papers' man.
        numbers: For each link, how many shapes of other people each of them is.
        count: Number of shapes of the environment with the papers' man.
    """
    times = np.ones(count, dtype=np.intp)
    for part in parts:
        times[part.row] = numbers[part.link][part.of_man]
    first = np.cumsum(times) - times
    before = [np.cumsum([0, *of_link]) for of_link in numbers]
    found = [
        _PartOfLink(
            int(first[part.row]) + k,
            part.link,
            int(before[part.link][part.of_man]) + k,
            part.of_man,
        )
        for part in parts
        for k in range(times[part.row])
    ]
    return np.repeat(np.arange(count), times), found
