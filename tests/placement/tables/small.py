"""Small grids and score tables, and plain loops over all their sets."""

from __future__ import annotations

import itertools
import math

import numpy as np

from tcs.model.grid import Grid
from tcs.placement.tables import Reason, ScoreTable


def small_grid(nx=4, ny=3, yaws=2, torsos=2, *, step=0.2, bed=0, head=0):
    """Return a grid of base positions `step` apart, optionally with bed and head rest."""
    spec = {}
    if bed:
        spec["bed_height"] = {"unit": "m", "start": 0.0, "step": 0.1, "count": bed}
    if head:
        spec["head_rest"] = {"unit": "deg", "start": 0.0, "step": 35.0, "count": head}
    spec |= {
        "base_x": {"unit": "m", "start": -0.7, "step": step, "count": nx},
        "base_y": {"unit": "m", "start": 0.1, "step": step, "count": ny},
        "base_yaw": {"unit": "deg", "start": 0.0, "step": 360.0 / max(yaws, 1), "count": yaws},
        "torso": {"unit": "m", "start": 0.0, "step": 0.15, "count": torsos},
    }
    return Grid.from_spec(spec)


def random_scores(grid, goals, seed, *, levels=0, share=0.5):
    """Random scores; `levels` > 0 allows only so many isotropies, so that sets tie."""
    rng = np.random.default_rng(seed)
    shape = (grid.size, goals)
    dexterity = rng.random(shape, dtype=np.float32)
    if levels:
        dexterity = np.floor(dexterity * levels).astype(np.float32) / np.float32(levels)
    reached = rng.random(shape) < share
    blocked = rng.integers(Reason.TOO_FAR, Reason.EXCLUDED, size=shape)
    reason = np.where(reached, Reason.REACHED, blocked).astype(np.uint8)
    named = reason >= Reason.BODY_BLOCKED
    raw = rng.integers(1, 4, size=goals).astype(np.float64)
    return ScoreTable(
        dexterity=np.where(reached, dexterity, np.float32(0.0)),
        reason=reason,
        pair=np.where(named, rng.integers(0, 3, size=shape), -1).astype(np.int16),
        pair_names=(("arm", "chair"), ("base", "chair"), ("gripper", "head")),
        arm_joints=rng.uniform(-2.0, 2.0, (int(reached.sum()), 7)).astype(np.float32),
        weights=raw / raw.sum(),
    )


def set_scores(scores, members):
    """P_R and P_M of a set, eq. (1) and (4) in plain loops."""
    reachability = manipulability = 0.0
    for g, weight in enumerate(scores.weights.tolist()):
        if any(scores.reached[h, g] for h in members):
            reachability += weight
        manipulability += weight * max(float(scores.dexterity[h, g]) for h in members)
    return reachability, manipulability


def all_sets(scores, grid, min_distance, rule="paper", same_environment=False, max_members=2):
    """Every kept set in the order that breaks ties: {members: (P_R, P_M)}."""
    singles = [(h,) for h in range(grid.size) if scores.reached[h].any()]
    kept = {members: set_scores(scores, members) for members in singles}
    if rule == "code2015":
        # A billionth short of two fifths is a rounding error.
        kept = {members: both for members, both in kept.items() if both[0] >= 0.40 - 1e-9}
        singles = list(kept)
    best = max(kept.values(), default=(0.0, 0.0))
    threshold = max((manipulability for _, manipulability in kept.values()), default=0.0)
    at = {h: grid.configuration(h) for (h,) in singles}

    def together(a, b):
        p, q = (at[a].base_x, at[a].base_y), (at[b].base_x, at[b].base_y)
        if rule == "code2015":
            p, q = np.round(p, 3), np.round(q, 3)
        if same_environment and at[a].environment != at[b].environment:
            return False
        # A nanometre less is accepted: steps of 0.2 are no binary fractions.
        return math.dist(p, q) >= min_distance - 1e-9

    pairs = {
        pair
        for pair in itertools.combinations([h for (h,) in singles], 2)
        if max_members > 1 and together(*pair)
    }
    for a, b in sorted(pairs):
        both = set_scores(scores, (a, b))
        if rule == "code2015":
            larger = max(kept[a,][1], kept[b,][1])
            keep = both[1] >= 1.01 * best[1] and both[1] >= 1.01 * larger
            keep = keep and both[0] >= 0.98 * best[0] - 1e-9
        else:
            keep = both[1] > threshold
        if keep:
            kept[a, b] = both
    if max_members > 2:
        threshold = max((manipulability for _, manipulability in kept.values()), default=0.0)
        for a, b in sorted(pairs):
            for (c,) in singles:
                if b < c and (a, c) in pairs and (b, c) in pairs:
                    three = set_scores(scores, (a, b, c))
                    if three[1] > threshold:
                        kept[a, b, c] = three
    return kept


def order_of(rule, scores):
    """Return the keys by which sets with these P_R and P_M are ordered, greatest first."""
    return tuple(scores) if rule == "code2015" else scores[0] + scores[1]
