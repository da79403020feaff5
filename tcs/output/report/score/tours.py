"""Motions of a reported set: its tours, and how near the arm comes to what is around it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from tcs.model.scene import Contact, Scene
from tcs.model.scene.contacts import Group
from tcs.motion import MotionPlan, Segment, StopPlan
from tcs.output.report.blocks import Block, Bullets, Cell, Column, Table, Text
from tcs.output.words import frame_name, pair_text
from tcs.output.words.success import not_done_text, place_text

FARTHEST = 0.10
"""Distance beyond which clearances are not measured [m]."""
_RATE = 20.0
"""Postures per second at which clearances are measured."""


@dataclass(frozen=True, eq=False)
class Tours:
    """The motions of a set, with the clearance of each."""

    plan: MotionPlan
    """The plan, its stops in the order of the set."""
    clearances: tuple[tuple[Contact | None, ...], ...]
    """For each segment of each stop the least distance between the arm and the environment, with
    the two bodies; None beyond FARTHEST."""

    @classmethod
    def of(cls, plan: MotionPlan, scenes: Mapping[str, Scene]) -> Tours:
        """Measure the clearances of a plan with Drake.

        Args:
            plan: The plan.
            scenes: The scene of each hand, in the observed state; the rest is set.
        """
        return cls(plan, tuple(_clearances(stop, scenes[stop.hand]) for stop in plan.stops))

    def to_json(self) -> dict[str, Any]:
        """Return a summary as plain containers."""
        return {
            "goals_done": self.plan.goals_done,
            "edges": self.plan.edges,
            "false": self.plan.false,
            "stops": [
                {
                    "goals": list(stop.goals),
                    "duration": stop.duration,
                    "clearance": _least(clearances),
                }
                for stop, clearances in zip(self.plan.stops, self.clearances, strict=True)
            ],
            "not_done": [one.to_json() for one in self.plan.results if not one.done],
        }


def tours_blocks(tours: Tours, frames: Sequence[str]) -> list[Block]:
    """Return the tour of each stop, what Drake found, and why goals are not done.

    Args:
        tours: The motions.
        frames: Body frame of each goal.
    """
    plan = tours.plan
    blocks: list[Block] = [
        Text(
            f"{plan.goals_done} of {len(plan.results)} goals can be done: the arm goes from rest "
            "to each in turn, straight in and straight out, and back to rest, free of contact. "
            f"Drake re-checked {plan.edges:,} pieces of the motions at postures between which no "
            f"point of the arm moves by more than a millimetre; {plan.false or 'none'} "
            f"{'is' if plan.false == 1 else 'are'} false."
        )
    ]
    for number, stop in enumerate(plan.stops):
        if stop.segments:
            blocks.append(_tour_table(number, stop, tours.clearances[number], frames))
        else:
            blocks.append(Text(f"No goal can be done from stop {number + 1}."))
    failures = [not_done_text(one.to_json()) for one in plan.results if not one.done]
    return [*blocks, Bullets(failures)] if failures else blocks


def _tour_table(
    number: int, stop: StopPlan, clearances: Sequence[Contact | None], frames: Sequence[str]
) -> Table:
    """Return the segments of a stop in their order."""
    rows = []
    for segment, contact in zip(stop.segments, clearances, strict=True):
        plain = segment.to_json()
        ends = [_end(plain, key, frames) for key in ("from", "to")]
        near: list[Cell | str] = [f"over {100 * FARTHEST:.0f}", Cell("–", "quiet")]
        if contact is not None:
            near = [f"{100 * contact[2]:.1f}", pair_text(contact[:2])]
        rows.append([segment.type, *ends, f"{plain['duration']:.1f}", *near, str(segment.edges)])
    back = "" if stop.returns else " No path back to rest was found."
    return Table(
        f"The tour at stop {number + 1}: {stop.duration:.1f} s. Clearance: least distance between "
        "the arm and the person, furniture or floor, at "
        f"{_RATE:.0f} postures a second.{back}",
        [
            *(Column(title, is_number=False) for title in ("Motion", "From", "To")),
            Column("Time [s]"),
            Column("Clearance [cm]"),
            Column("Nearest", is_number=False),
            Column("Pieces re-checked"),
        ],
        rows,
    )


def _end(plain: Mapping[str, Any], key: str, frames: Sequence[str]) -> str:
    """Return the begin or end of a segment, a goal with its body frame."""
    place = plain[key]
    return (
        place_text(place)
        if place == "rest"
        else f"{place_text(place)}, {frame_name(frames[place])}"
    )


def _clearances(stop: StopPlan, scene: Scene) -> tuple[Contact | None, ...]:
    """Return the least clearance of each segment of a stop."""
    for name, value in stop.at.environment:
        scene.set_joint(name, value)
    scene.place_base(stop.at.base_x, stop.at.base_y, stop.at.base_yaw)
    scene.set_torso(stop.at.torso)
    groups = {part.name: part.group for part in scene.built.parts}
    return tuple(_clearance(segment, scene, groups) for segment in stop.segments)


def _clearance(segment: Segment, scene: Scene, groups: Mapping[str, Group]) -> Contact | None:
    """Return the least distance between the arm and the environment on a segment."""
    timing = segment.timing
    spline = CubicHermiteSpline(timing.times, timing.positions, timing.velocities)
    count = max(int(np.ceil(timing.duration * _RATE)), 1) + 1
    found: list[Contact] = []
    for q in spline(np.linspace(0.0, timing.duration, count)):
        scene.set_arm(q)
        found += [
            contact
            for contact in scene.clearances(FARTHEST)
            if (groups[contact[0]], groups[contact[1]]) == (Group.ARM, Group.ENVIRONMENT)
        ][:1]
    return min(found, key=lambda contact: contact[2], default=None)


def _least(clearances: Sequence[Contact | None]) -> float | None:
    """Return the least clearance [m]; None beyond FARTHEST."""
    return min((one[2] for one in clearances if one is not None), default=None)
