"""Measure the kernel and other solvers on the same problems, in the same run.

Usage: python benchmarks/peers.py [--problems 100] [--seed 0] [--repeats 5]
           [--peers drake,eaik,tracik,pinocchio]

The peers EAIK, TRAC-IK and pinocchio are optional: `pip install '.[benchmarks]'`; an absent one is
skipped with a message. docs/benchmarks.md explains each line. Times of one run are comparable:
solvers alternate from problem to problem, and times of single problems are processor time, which
excludes other programs.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from kernel_costs import grid_costs, part_costs, sweep_costs
from numpy.typing import NDArray
from peer_arms import EaikSweep, PinocchioClik, TracIk, UnfitArmError
from peer_drake import DrakeIk
from peer_kernel import Kernel
from peer_problems import ENVIRONMENT, ROBOT, TASK, Answer, Bench, Judge, Pair, Peer, draw
from table import cell, header, parser, row, save

from tcs.kernel.arrays import Chain

OPTIONAL = {
    "eaik": ("EAIK", EaikSweep),
    "tracik": ("TRAC-IK", TracIk),
    "pinocchio": ("pinocchio CLIK", PinocchioClik),
}
"""Peers that are separate packages, by their names on the command line."""
NAMES = ("drake", *OPTIONAL)
BLOCKS = 5
"""Number of blocks of problems; the range of ratios is taken over them."""
REFERENCE_PEER = "Drake IK, min distance, 5 tries"


@dataclass(frozen=True, eq=False)
class Record:
    """Results of one solver on every problem, arrays of shape (problems,)."""

    seconds: NDArray[np.float64]
    at_goal: NDArray[np.bool_]
    free: NDArray[np.bool_]
    solutions: NDArray[np.int64]

    @classmethod
    def empty(cls, count: int) -> Record:
        """Return a record without results."""
        no = np.zeros(count, np.bool_)
        return cls(np.zeros(count), no, no.copy(), np.zeros(count, np.int64))

    def note(self, i: int, answer: Answer, judge: Judge, pair: Pair) -> None:
        """Record an answer to problem i and Drake's verdict on it."""
        self.seconds[i], self.solutions[i] = answer.seconds, len(answer.postures)
        for q in answer.postures:
            verdict = judge.check(pair, q)
            self.at_goal[i] |= verdict.at_goal
            self.free[i] |= verdict.free
            if verdict.free:
                break


def main(arguments: list[str] | None = None) -> int:
    """Run every measurement and print it."""
    options = parse(arguments)
    # Drake logs every context that it creates.
    logging.getLogger("drake").setLevel(logging.WARNING)
    header("eaik", "pytracik", "pin")
    bench = Bench.build()
    judge = Judge(bench)
    problems = draw(bench, judge, options.problems, options.seed)
    pairs = problems.pairs
    reachable = np.array([pair.reachable for pair in pairs], dtype=np.bool_)
    row("problems", f"{TASK}, {ENVIRONMENT}, {ROBOT}, seed {options.seed}")
    row(
        "  base free, goal within reach",
        f"{np.sum(reachable)} reachable, {np.sum(~reachable)} not, of {problems.drawn} that a "
        f"dense scan checked; Drake refused {problems.unconfirmed} of its solutions",
    )
    kernel = Kernel(bench)
    peers = [kernel, *chosen(options.peers, bench)]
    records = {label: Record.empty(len(pairs)) for peer in peers for label in peer.labels}
    ours = np.zeros(len(pairs))
    blocks = [np.arange(len(pairs))[b::BLOCKS] for b in range(BLOCKS)]
    for block in blocks:
        for is_reachable in (True, False):
            same = [int(i) for i in block if reachable[i] == is_reachable]
            if same:
                ours[same] = kernel.seconds(tuple(pairs[i] for i in same)) / len(same)
        for i in block:
            for peer in peers:
                rng = np.random.default_rng([options.seed, int(i)])
                for label, answer in zip(peer.labels, peer.solve(pairs[i], rng), strict=True):
                    records[label].note(int(i), answer, judge, pairs[i])
    show_answers(records, reachable)
    show_times(records, reachable)
    show_ratios(records, reachable, ours, blocks)
    if options.repeats:
        sweep_costs(bench, options.repeats)
        grid_costs(bench, options.repeats)
        part_costs(bench, pairs, options.repeats)
    row("load when it ended", ", ".join(f"{load:.2f}" for load in os.getloadavg()))
    save(options)
    return 0


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    command_line = parser(__doc__)
    command_line.add_argument("--problems", type=int, default=100, help="half of them reachable")
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument(
        "--repeats", type=int, default=5, help="repeats of the sweeps; 0 for none"
    )
    command_line.add_argument(
        "--peers", default=",".join(NAMES), help=f"some of {', '.join(NAMES)}; '' for none"
    )
    options = command_line.parse_args(arguments)
    if options.problems < 2 or options.seed < 0 or options.repeats < 0:
        command_line.error("--problems must be 2 or more, --seed and --repeats not negative")
    options.peers = [name for name in options.peers.split(",") if name]
    unknown = sorted(set(options.peers) - set(NAMES))
    if unknown:
        command_line.error(f"--peers: '{unknown[0]}' is unknown; there are {', '.join(NAMES)}")
    return options


def chosen(names: list[str], bench: Bench) -> list[Peer]:
    """Return the installed peers of these names, and print which are absent."""
    found: list[Peer] = []
    if "drake" in names:
        found += [DrakeIk(bench.lowered, distance=False), DrakeIk(bench.lowered, distance=True)]
    for name, (title, make) in OPTIONAL.items():
        if name in names:
            found += made(title, make, bench.lowered.arrays.chain)
    return found


def made(title: str, make: Callable[[Chain], Peer], chain: Chain) -> list[Peer]:
    """Return the peer in a list; an empty list, with a message, if it cannot be used."""
    try:
        return [make(chain)]
    except ModuleNotFoundError as error:
        row(title, f"skipped: no module '{error.name}' (pip install '.[benchmarks]')")
    except (ImportError, UnfitArmError) as error:
        row(title, f"skipped: {' '.join(str(error).split())}")
    return []


def show_answers(records: dict[str, Record], reachable: NDArray[np.bool_]) -> None:
    """Print how many problems each solver answers, and how many answers hold."""
    _cells("answers", "at goal", "free", "unreach. at goal", "unreach. free", "solutions")
    for label, record in records.items():
        counts = [
            f"{np.sum(kept[subset])} of {np.sum(subset)}"
            for subset in (reachable, ~reachable)
            for kept in (record.at_goal, record.free)
        ]
        counts.append(f"{np.mean(record.solutions[reachable]):.1f}")
        _cells(f"  {label}", *counts)
        headings = (
            "reachable: at goal",
            "reachable: free",
            "unreachable: at goal",
            "unreachable: free",
            "solutions",
        )
        for heading, text in zip(headings, counts, strict=True):
            cell("answers", label, heading, text)


def show_times(records: dict[str, Record], reachable: NDArray[np.bool_]) -> None:
    """Print the time of a problem: median, and 10th to 90th percentile."""
    _cells("time of one problem [ms]", "reachable", "unreachable", width=32)
    for label, record in records.items():
        texts = [_quantiles(1e3 * record.seconds[subset]) for subset in (reachable, ~reachable)]
        _cells(f"  {label}", *texts, width=32)
        for heading, text in zip(("reachable", "unreachable"), texts, strict=True):
            cell("times", label, f"{heading} [ms]", text)


def show_ratios(
    records: dict[str, Record],
    reachable: NDArray[np.bool_],
    ours: NDArray[np.float64],
    blocks: list[NDArray[np.int64]],
) -> None:
    """Print the ratios of all times to ours: over all problems, and over each subset.

    Args:
        records: Of all solvers, ours first.
        reachable: Which problems are reachable.
        ours: Our time of each problem, solved one after the other [s].
        blocks: Indices of the problems that were solved together.
    """
    row("our problems a second, 1 thread", f"{len(ours) / np.sum(ours):.3g}")
    if len(records) == 1:
        return
    subsets = (np.ones_like(reachable), reachable, ~reachable)
    _cells("time / ours", "all", "reachable", "unreachable", width=32)
    for label, record in list(records.items())[1:]:
        texts = []
        for subset in subsets:
            parts = [block[subset[block]] for block in blocks]
            ratios = [np.sum(record.seconds[p]) / np.sum(ours[p]) for p in parts if p.size]
            whole = np.sum(record.seconds[subset]) / np.sum(ours[subset])
            texts.append(f"{whole:.4g}x ({min(ratios):.4g} .. {max(ratios):.4g})")
        _cells(f"  {label}", *texts, width=32)
        for heading, text in zip(("all", "reachable", "unreachable"), texts, strict=True):
            cell("ratios", label, f"time / ours, {heading}", text)
    if REFERENCE_PEER in records:
        theirs, own = records[REFERENCE_PEER], next(iter(records.values()))
        times = [
            f"{np.sum(theirs.seconds[subset]) / np.sum(ours[subset]):.0f}" for subset in subsets
        ]
        row("ours against", REFERENCE_PEER)
        row(
            "  problems a second",
            f"{times[0]} times as many; {times[1]} on reachable, {times[2]} on unreachable ones",
        )
        found = [f"{np.mean(record.free[reachable]):.1%}" for record in (own, theirs)]
        row("  found of reachable, free", f"{found[0]} against {found[1]}")


def _cells(name: str, *texts: str, width: int = 18) -> None:
    row(name, "".join(f"{text:<{width}}" for text in texts).rstrip())


def _quantiles(values: NDArray[np.float64]) -> str:
    low, middle, high = np.quantile(values, (0.1, 0.5, 0.9))
    return f"{middle:.3g} ({low:.3g} .. {high:.3g})"


if __name__ == "__main__":
    sys.exit(main())
