"""Proportions: how much larger each link of a person is than that of the papers' average man.

The shapes of the models `person_seated.sdf` and `person_lying.sdf` are those of one man. He is
assigned a body of the survey: what can be read off his shapes is `PAPERS_MAN`, the rest is filled
in. A link of another person has the size of his, times the ratio of the measures in `LINKS`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from tcs.errors import DataFileError
from tcs.kernel.arrays import FloatArray
from tcs.model.people.bodies import Bodies, Body, body

PAPERS_MAN: Mapping[str, float] = {
    # From the underside of the thighs to the crown, seated.
    "sittingheight": 0.882,
    # From the rear of the lower body to the front of the knee, seated.
    "buttockkneelength": 0.609,
    # From the sole to the top of the knee, along the calf.
    "kneeheightsitting": 0.550,
    "thighclearance": 0.184,
    "hipbreadthsitting": 0.332,
    # From the top of the shoulder to the underside of the elbow, along the upper arm.
    "shoulderelbowlength": 0.369,
    # From the back of the elbow to the fingertip.
    "forearmhandlength": 0.490,
    "handlength": 0.190,
    "chestdepth": 0.221,
    "abdominalextensiondepthsitting": 0.201,
    "waistbreadth": 0.279,
    # Girths of the capsules.
    "bicepscircumferenceflexed": 0.308,
    "forearmcircumferenceflexed": 0.275,
    "calfcircumference": 0.342,
    "neckcircumference": 0.367,
    "footlength": 0.273,
}
"""Measures of the papers' man, read off the collision shapes of his model [m]. His head is rounder
than any in the survey, so its measures are not among them."""

Sum = Mapping[str, float]
"""A length as a sum of measures, each with its factor."""

# From the joint at the base of the neck to the hip joint: below the crown by one and a half times
# the height of the ear's tragion, above the seat by half of the thigh.
_TRUNK: Sum = {"sittingheight": 1.0, "tragiontopofhead": -1.5, "thighclearance": -0.5}

LINKS: Mapping[str, tuple[Sum, Sum, Sum]] = {
    # x forward, y to the left, z to the crown.
    "head": ({"headlength": 1.0}, {"headbreadth": 1.0}, {"tragiontopofhead": 1.0}),
    # From here on: x along the limb, y to the front, z across.
    "neck": (_TRUNK, {"neckcircumference": 1.0}, {"neckcircumference": 1.0}),
    "upper_body": (_TRUNK, {"chestdepth": 1.0}, {"biacromialbreadth": 1.0}),
    "mid_body": (_TRUNK, {"abdominalextensiondepthsitting": 1.0}, {"waistbreadth": 1.0}),
    "lower_body": (_TRUNK, {"buttockdepth": 1.0}, {"hipbreadthsitting": 1.0}),
    "arm": (
        {"shoulderelbowlength": 1.0},
        {"bicepscircumferenceflexed": 1.0},
        {"bicepscircumferenceflexed": 1.0},
    ),
    "forearm": (
        {"forearmhandlength": 1.0, "handlength": -1.0},
        {"forearmcircumferenceflexed": 1.0},
        {"forearmcircumferenceflexed": 1.0},
    ),
    "hand": ({"handlength": 1.0}, {"handbreadth": 1.0}, {"handbreadth": 1.0}),
    # The hip joint is in the middle of the buttock's depth.
    "quad": (
        {"buttockkneelength": 1.0, "buttockdepth": -0.5},
        {"thighclearance": 1.0},
        {"hipbreadthsitting": 1.0},
    ),
    "calf": ({"kneeheightsitting": 1.0}, {"calfcircumference": 1.0}, {"calfcircumference": 1.0}),
    # x up, y to the toes, z across.
    "foot": (
        {"lateralmalleolusheight": 1.0},
        {"footlength": 1.0},
        {"footbreadthhorizontal": 1.0},
    ),
}
"""For the links of the person: the lengths that its sizes along x, y and z of its frame follow."""

_RATIOS = (0.6, 2.5)
"""Least and greatest ratio; those of the survey's people lie within."""
_LEAST_OF_CHILDREN = 0.3
"""Least ratio of children."""

Scale = tuple[float, float, float]
"""Ratios of sizes along x, y and z of a link's frame."""


@cache
def papers_man() -> Body:
    """Return the body of the survey that the papers' average man is assigned."""
    return body("male", measures=PAPERS_MAN)


def link_scales(person: Body) -> dict[str, Scale]:
    """Return the sizes of the links of a person relative to the papers' man.

    >>> set(link_scales(papers_man()).values())
    {(1.0, 1.0, 1.0)}

    Args:
        person: All measures of the person.

    Returns:
        By the keys of `LINKS`, the ratios along x, y and z of the link's frame.

    Raises:
        DataFileError: If measures contradict each other, so that a link has no length left.
    """
    values = {name: np.array([value]) for name, value in person.measures.items()}
    least = _least((person.age,))
    ratios = _ratios(values, ("person",), least)
    return {link: _triple(of_link[0]) for link, of_link in ratios.items()}


def scales_of_people(people: Bodies) -> list[dict[str, Scale]]:
    """Return what `link_scales` returns for each of many people.

    Raises:
        DataFileError: If the measures of a person contradict each other.
    """
    values = dict(zip(people.measures, people.values.T, strict=True))
    names = tuple(f"person {number}" for number in range(len(people)))
    least = _least(people.ages or (None,) * len(people))
    ratios = {link: found.tolist() for link, found in _ratios(values, names, least).items()}
    return [
        {link: _triple(found[number]) for link, found in ratios.items()}
        for number in range(len(people))
    ]


def _triple(ratios: FloatArray | list[float]) -> Scale:
    x, y, z = map(float, ratios)
    return x, y, z


def _least(ages: Sequence[float | None]) -> FloatArray:
    """Return the least ratio of people of these ages, shape (N,)."""
    return np.array([_RATIOS[0] if age is None else _LEAST_OF_CHILDREN for age in ages])


def _ratios(
    values: Mapping[str, FloatArray], people: tuple[str, ...], least: FloatArray
) -> dict[str, FloatArray]:
    """Return the ratios of each link, shapes (N, 3).

    Args:
        values: The measures of N people, shapes (N,).
        people: What messages call each of them.
        least: Least ratio of each of them, shape (N,).
    """
    reference = papers_man().measures
    found = {}
    for link, sums in LINKS.items():
        columns = []
        for measures in sums:
            before = sum(factor * reference[name] for name, factor in measures.items())
            after = sum(factor * values[name] for name, factor in measures.items())
            columns.append(np.asarray(after / before))
            _check(columns[-1], people, link, measures, least)
        found[link] = np.stack(columns, axis=1)
    return found


def _check(
    ratios: FloatArray, people: tuple[str, ...], link: str, measures: Sum, least: FloatArray
) -> None:
    """Refuse people of whom a link would have no plausible size."""
    for number in np.flatnonzero(~((least <= ratios) & (ratios <= _RATIOS[1])))[:1]:
        raise DataFileError(
            f"{people[number]}: {', '.join(measures)} do not fit together: the "
            f"{link.replace('_', ' ')} would be {ratios[number]:.2g} times that of an average man. "
            "Check the measured values."
        )
