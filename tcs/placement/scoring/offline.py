"""Offline scoring: one task on the whole grid of its environment, and the sets to choose from."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np

from tcs.errors import RobotError
from tcs.files.blocks import BlockFolder
from tcs.files.mapped import chunks
from tcs.kernel.arrays import FloatArray, SceneArrays, Shapes
from tcs.kernel.dexterity import DEFAULT_MEASURE, dexterity
from tcs.model.grid import Grid
from tcs.model.people import PersonLike
from tcs.model.robots import BOTH, RobotFile, arm_references
from tcs.model.scene import EnvironmentFile, Scene, SceneSpec, body_frame_positions
from tcs.model.tasks import Goal, Task, ToolLine, partners
from tcs.placement.constraints import (
    Constraints,
    Footprint,
    constraints_entry,
    excluded_configurations,
)
from tcs.placement.scoring.approaches import ApproachChoice, approach_lines, choose_approach
from tcs.placement.scoring.engines import ScoringEngine
from tcs.placement.scoring.hands import digest_of_hands, joined
from tcs.placement.scoring.job import BARE, Job, JobOptions, data_references, load_jobs, whole_task
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC
from tcs.placement.scoring.person import person_entry
from tcs.placement.scoring.sets import SetOptions, checked_options, kept_sets
from tcs.placement.scoring.sweep import sweep
from tcs.placement.scoring.together import Hands, together
from tcs.placement.store import ARMS, HANDS, OF_HAND, PAPER, ScoreFile, StateTables
from tcs.placement.store.robot_shapes import Primitives, RobotShapes
from tcs.placement.tables import Reason, ScoreTable

NO_CONSTRAINTS = Constraints()
WITHOUT = ApproachChoice(False)

_log = logging.getLogger(__name__)


class Scored(NamedTuple):
    """The scores of a job, and what its score file records about them."""

    tables: tuple[ScoreTable, ...]
    """Scores of each observed state."""
    entries: Mapping[str, Any]
    """Entries of the metadata."""


@dataclass(frozen=True, eq=False)
class ScoringSetup:
    """A job with its live scene and the options of its scoring."""

    job: Job
    scene: Scene
    """The job's scene; scoring leaves its state unchanged."""
    references: Mapping[str, str]
    """Names or absolute paths of task, environment and robot."""
    sets: SetOptions
    """Which sets are kept."""
    measure: str
    """Name of the dexterity measure."""
    jobs: int = 2
    """Number of threads; the result does not depend on it."""
    approach: ApproachChoice = WITHOUT
    """Whether a goal counts as reached only by postures that can be approached."""
    blocks: BlockFolder | None = None
    """Where finished blocks of the grid are kept; None to keep none."""
    engine: ScoringEngine | None = None
    """Who scores; None for `jobs` threads of this process."""

    def scored(
        self,
        *,
        on_progress: Callable[[int, int], None] | None = None,
        on_compile: Callable[[], None] | None = None,
    ) -> Scored:
        """Return the scores of the job, before sets are built.

        A pair of robot bodies that refuses more goals than are reached is logged as a warning and
        recorded in the metadata as `self_contact`.

        Args:
            on_progress: Called with the number of scored configurations and their total.
            on_compile: Called before the kernel compiles, if it has to.
        """
        job = self.job
        lowered = job.lowered(self.scene)
        # Obstacles that are seen later are in W, base poses on a mount are not.
        is_mounted = job.spec.environment.mount is not None
        shapes = None if is_mounted else robot_shapes(lowered.arrays)
        excluded = excluded_configurations(
            job.constraints.forbid, Footprint.of(shapes), job.scored_grid
        )
        swept = sweep(
            lowered,
            job.task.weights,
            tables=job.tables,
            measure=self.measure,
            jobs=self.jobs,
            on_progress=on_progress,
            on_compile=on_compile,
            excluded=excluded,
            approaches=approach_lines(job) if self.approach.is_scored else None,
            blocks=self.blocks,
            engine=self.engine,
        )
        contact = prevailing_self_contact(swept.tables, lowered.robot_bodies)
        if contact is not None:
            advice = contact.advice(job.spec.robot)
            _log.warning("%s, %s: %s", job.task.name, job.spec.environment.name, advice)
        return Scored(
            swept.tables,
            {
                **constraints_entry(job.constraints, excluded),
                **({} if shapes is None else {"robot_shapes": shapes.to_dict()}),
                "scene_digest": lowered.digest(),
                "ik": swept.ik,
                "self_contact": None if contact is None else contact.to_json(),
                "timings": {
                    "compile_seconds": swept.compile_seconds,
                    "scoring_seconds": swept.scoring_seconds,
                    "approach_seconds": swept.approach_seconds,
                },
            },
        )

    def file_of(
        self,
        scores: Sequence[ScoreTable],
        grid: Grid,
        begun: float,
        entries: Mapping[str, Any],
    ) -> ScoreFile:
        """Return the score file of scores, with the sets built from them.

        Args:
            scores: Scores of each observed state.
            grid: Their grid.
            begun: Start of the work, by `time.perf_counter` [s].
            entries: Entries of the metadata, of `Scored.entries` and others.
        """
        job = self.job
        sets_begun = time.perf_counter()
        tables = tuple(
            StateTables.of(table, kept_sets(self.blocks, table, grid, jobs=self.jobs, **self.sets))
            for table in scores
        )
        done = time.perf_counter()
        return ScoreFile(
            metadata={
                "program_version": version("tcs"),
                "created": datetime.now(UTC).isoformat(timespec="seconds"),
                **self.references,
                **({PAPER: True} if job.paper else {}),
                **({"only": list(job.constraints.only)} if job.constraints.only else {}),
                **entries,
                # Once for all hands and arms, with the goals as the file numbers them.
                **person_entry(job.spec.environment, job.task, scores),
                "measure": self.measure,
                **self.approach.entry,
                "timings": {
                    **entries["timings"],
                    "sets_seconds": done - sets_begun,
                    "total_seconds": done - begun,
                },
            },
            task=_task_as_dict(job.task),
            robot=job.spec.robot.model_dump(mode="json"),
            environment=job.spec.environment.model_dump(mode="json"),
            grid=grid.to_dict(),
            observed=[axis.to_dict() for axis in job.observed],
            body_frames=body_frame_positions(self.scene, job.scored_grid),
            tables=tables,
        )


def score(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile = "wheelchair",
    robot: str | Path | RobotFile = "pr2",
    *,
    arms: str | None = None,
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
    only: Sequence[str] = (),
    constraints: Constraints = NO_CONSTRAINTS,
    now: Mapping[str, float] | None = None,
    person: PersonLike | None = None,
    approach: bool | None = None,
    paper: bool = False,
    blocks: BlockFolder | None = None,
    engine: ScoringEngine | None = None,
    **sets: Unpack[SetOptions],
) -> ScoreFile:
    """Score a task on the whole grid of an environment and build the sets to choose from.

    Args:
        task: Name of a task, path of a task file, or a task.
        environment: Name of an environment, path of its file, or an environment.
        robot: Name of a robot, path of its file, or a robot.
        arms: Arm of the goals that name none: one of the robot's, e.g. "left", or "both", to reach
            each of them with the arm that reaches it best. By default the arm that the robot file
            describes.
        measure: Dexterity measure to maximise at each goal: "isotropy", "inverse-condition", one
            of them with a penalty near joint limits, "-limited" or "-limited-thesis", or "jlwki".
            Equations: docs/method.md.
        jobs: Number of threads; the result does not depend on it.
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.
        only: Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; other values are not
            scored, and the sets are built from what remains.
        constraints: Constraints as for `tcs.select`. Configurations on forbidden regions are not
            scored, and blocked boxes become obstacles of the environment. Preferences have no
            effect.
        now: Present values of axes [m or rad], for the axes that the constraints keep.
        person: Whose body the person has, e.g. `{"sex": "female", "stature_percentile": 5}`, or the
            path of a file; by default that of the environment, which without a body of its own has
            that of the papers' average man. Goals on the person are moved to that body.
        approach: Whether a goal counts as reached only by postures that the arm can leave backwards
            along the goal's approach. The best of these gives joints and dexterity. By default
            wherever approaches can be scored: goals that one arm reaches at a time, and known
            velocity limits. Elsewhere the file records why not (`no_approach`).
        paper: Score as the papers do: each goal at its own pose alone, whatever the task lets free,
            and without approach. The file records it (`paper`), and what is done with it later
            counts contacts of the body as the papers do.
        blocks: Folder in which finished blocks of the grid are kept, so that the same call
            continues after the process was killed; see `tcs.placement.scoring.BlockFolder`.
        engine: Who scores: `Threads` or `Dask` of `tcs.placement.scoring.engines`; by
            default `jobs` threads. The scores are the same.
        **sets: Options of the kept sets: `rule`, `same_environment`, `max_members`,
            `min_distance`; see `tcs.placement.scoring.SetOptions`.

    Returns:
        Scores and sets, ready for `tcs.save` and `tcs.select`.

    Raises:
        UnknownNameError: If a task, environment, robot, arm, frame or measure of that name does
            not exist.
        DataFileError: If a file cannot be used.
        RobotError: If `arms` is given and the robot file names no arms, or no file of an arm can be
            used.
        GridError: If the grid is empty or enormous, or a condition is invalid.
        SelectionError: If the present value of an axis to keep is missing or not scored, or every
            base pose is forbidden.
        TcsError: If an option of the sets is out of range, or the workers of the engine are lost.
        ArmClassError: If `approach` is requested where it cannot be scored, or with `paper`.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.
    """
    begun = time.perf_counter()
    setups = load_setups(
        task, environment, robot, measure=measure, jobs=jobs, sets=sets, approach=approach,
        arms=arms, only=only, constraints=constraints, now=now, person=person, paper=paper,
    )  # fmt: skip
    setups = tuple(replace(setup, blocks=blocks, engine=engine) for setup in setups)
    return score_setups(setups, begun=begun, on_progress=on_progress, on_compile=on_compile)


def load_setups(
    task: str | Path | Task,
    environment: str | Path | EnvironmentFile,
    robot: str | Path | RobotFile,
    *,
    measure: str,
    jobs: int,
    sets: SetOptions,
    approach: bool | None = None,
    build: Callable[[Job], Scene] = Job.scene,
    **options: Unpack[JobOptions],
) -> tuple[ScoringSetup, ...]:
    """Load and check everything, and build the scene of each hand.

    The arguments are those of `score`; `build` returns the scene of a job, a new one or an equal
    one that was kept.

    Raises:
        TcsError: The errors of `score`.
    """
    dexterity(measure)
    of_sets = checked_options(**sets)
    arms = options.get("arms")
    if arms is not None and arms != BOTH:
        # The file names the robot of that arm.
        robot = arm_references(robot, arms)[arms]
        options["arms"] = None
    built = [(job, build(job)) for job in load_jobs(task, environment, robot, **options)]
    choice = choose_approach(approach, [job for job, _ in built])
    return tuple(
        ScoringSetup(
            job, scene, data_references(job, task, environment, robot), of_sets, measure, jobs,
            choice,
        )
        for job, scene in built
    )  # fmt: skip


def score_setups(
    setups: Sequence[ScoringSetup],
    *,
    begun: float,
    metadata: Mapping[str, Any] | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Score a job of one or several hands, and return its score file.

    Args:
        setups: The job of each hand.
        begun: Start of the work, by `time.perf_counter` [s].
        metadata: Further entries of the file's metadata.
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.
    """
    if len(setups) > 1:
        return score_hands(
            setups, begun=begun, metadata=metadata, on_progress=on_progress, on_compile=on_compile
        )
    (setup,) = setups
    tables, entries = setup.scored(on_progress=on_progress, on_compile=on_compile)
    return setup.file_of(tables, setup.job.grid, begun, {**entries, **(metadata or {})})


def score_hands(
    setups: Sequence[ScoringSetup],
    *,
    begun: float,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> ScoreFile:
    """Score the goals of each hand, and return one file with all goals of each configuration.

    Args:
        setups: The job of each hand.
        begun: Start of the work, by `time.perf_counter` [s].
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.
        metadata: Further entries of the file's metadata.

    Raises:
        RobotError: If the arms have different grids: one has a torso joint, another has not.
    """
    jobs = [setup.job for setup in setups]
    for job in jobs:
        if job.grid != jobs[0].grid:
            raise RobotError(
                f"robots '{jobs[0].spec.robot.name}' and '{job.spec.robot.name}' have different "
                "torso joints, so no configuration serves the goals of both. Score them one by one."
            )
    size = jobs[0].scored_grid.size
    parts = [
        setup.scored(
            on_progress=_shifted(on_progress, number * size, len(setups) * size),
            on_compile=on_compile,
        )
        for number, setup in enumerate(setups)
    ]
    task = whole_task(jobs)
    numbers = [job.goal_numbers for job in jobs]
    states = [list(of_state) for of_state in zip(*(part.tables for part in parts), strict=True)]
    if any(partner is not None for partner in partners(task.goals)):
        built = [(setup.job, setup.job.lowered(setup.scene)) for setup in setups]
        hands = Hands.of(built, setups[0].measure)
        rows = jobs[0].grid.size
        states = [
            together(of_state, hands, first_row=state * rows, jobs=setups[0].jobs)
            for state, of_state in enumerate(states)
        ]
    tables = [joined(of_state, numbers, task.weights) for of_state in states]
    spec = SceneSpec(jobs[0].given_robot, jobs[0].spec.environment)
    whole = replace(jobs[0], task=task, spec=spec, hand=BARE, goal_numbers=())
    entries = {**_entries(jobs, parts), **(metadata or {})}
    return replace(setups[0], job=whole).file_of(tables, whole.grid, begun, entries)


def _entries(jobs: Sequence[Job], parts: Sequence[Scored]) -> dict[str, Any]:
    """Return the entries of the metadata: those of each hand, and what sums them up."""
    of_hands = [
        {
            **job.hand.to_json(),
            "goals": list(job.goal_numbers),
            "description": job.spec.robot.model_dump(mode="json"),
            **{key: part.entries[key] for key in OF_HAND if key in part.entries},
        }
        for job, part in zip(jobs, parts, strict=True)
    ]
    contacts = (entry["self_contact"] for entry in of_hands)
    timings = [part.entries["timings"] for part in parts]
    return {
        **{key: value for key, value in parts[0].entries.items() if key not in OF_HAND},
        **({ARMS: BOTH} if jobs[0].any_arm else {}),
        HANDS: of_hands,
        "scene_digest": digest_of_hands([entry["scene_digest"] for entry in of_hands]),
        "ik": NUMERIC if any(entry["ik"] == NUMERIC for entry in of_hands) else ANALYTIC,
        "self_contact": next((contact for contact in contacts if contact is not None), None),
        "timings": {key: sum(of_hand[key] for of_hand in timings) for key in timings[0]},
    }


def _shifted(
    on_progress: Callable[[int, int], None] | None, done: int, total: int
) -> Callable[[int, int], None] | None:
    """Return a report of progress that counts from `done` to `total`."""
    if on_progress is None:
        return None
    return lambda more, _: on_progress(done + more, total)


def _task_as_dict(task: Task) -> dict[str, Any]:
    """Return a task as plain containers."""
    return {
        "name": task.name,
        "title": task.title,
        "source": task.source,
        "tool": task.tool,
        "environments": list(task.environments),
        "allowed_contacts": [list(pair) for pair in task.allowed_contacts],
        **({"tools": dict(task.tools)} if task.tools else {}),
        "goals": [
            {
                "name": goal.name,
                "body_frame": goal.body_frame,
                "position": goal.position.tolist(),
                "quaternion_wxyz": goal.quaternion.tolist(),
                "weight": goal.weight,
                "approach": _line_as_dict(goal.approach),
                "retreat": _line_as_dict(goal.retreat),
                **({"free": goal.region} if goal.region else {}),
                **({"alternatives": _poses_as_dicts(goal)} if goal.alternatives else {}),
                **({"arm": goal.arm} if goal.arm else {}),
                **({"tool": goal.tool} if goal.tool else {}),
                **({"together_with": goal.together_with} if goal.together_with else {}),
            }
            for goal in task.goals
        ],
    }


def _poses_as_dicts(goal: Goal) -> list[dict[str, Any]]:
    """Return the poses of a goal beside its own as plain containers."""
    return [
        {
            "body_frame": pose.body_frame,
            "position": pose.position.tolist(),
            "quaternion_wxyz": pose.quaternion.tolist(),
            **({} if pose.free is None else {"free": str(pose.free)}),
        }
        for pose in goal.alternatives
    ]


def _line_as_dict(line: ToolLine) -> dict[str, Any]:
    """Return a straight tool motion as in a task file."""
    return {"direction": list(line.direction), "distance": line.distance}


MAX_SHAPES = 2000
"""Most shapes that are stored: twenty times those of the largest robot that ships."""

SAME = 1e-9
"""Greatest difference [m] between a shape and its place under a torso that only translates."""


def robot_shapes(arrays: SceneArrays) -> RobotShapes | None:
    """Return the robot's shapes, or None if there are too many or the torso does not translate.

    Args:
        arrays: The lowered scene.
    """
    if len(arrays.arm.type) + len(arrays.body.type) > MAX_SHAPES:
        return None
    torso_shift = _torso_shift(arrays)
    if torso_shift is None:
        return None
    return RobotShapes(
        chain_R=arrays.chain.R,
        chain_p=arrays.chain.p,
        arm_base_R=arrays.arm_base_R[0],
        arm_base_p=arrays.arm_base_p[0],
        torso_shift=torso_shift,
        arm=_primitives(arrays.arm),
        body=_primitives(arrays.body),
        margin=float(arrays.margin),
        slides=arrays.chain.slides,
        coupled=arrays.chain.coupled,
        rest=arrays.rest,
    )


def _torso_shift(arrays: SceneArrays) -> FloatArray | None:
    """Return the displacement of the torso at each level, shape (levels, 3), if it translates."""
    torso_shift: FloatArray = arrays.arm_base_p - arrays.arm_base_p[0]
    moved = arrays.body.p[0] + (arrays.body.frame == 1)[None, :, None] * torso_shift[:, None]
    same = (
        np.allclose(moved, arrays.body.p, rtol=0.0, atol=SAME)
        and np.allclose(arrays.body.R, arrays.body.R[0], rtol=0.0, atol=SAME)
        and np.allclose(arrays.arm_base_R, arrays.arm_base_R[0], rtol=0.0, atol=SAME)
    )
    return torso_shift if same else None


def _primitives(shapes: Shapes) -> Primitives:
    return Primitives(
        type=shapes.type.astype(np.int64),
        size=shapes.size,
        pad=shapes.pad,
        frame=shapes.frame.astype(np.int64),
        R=shapes.R[0],
        p=shapes.p[0],
    )


FEWEST = 20
"""Fewest refusals by one pair that count: fewer occur by chance on a small grid."""


@dataclass(frozen=True, slots=True)
class SelfContact:
    """A pair of robot bodies that refuses more goals than the robot reaches.

    Attributes:
        bodies: Names of the bodies.
        refused: Number of pairs of configuration and goal for which it is the contact found.
        reached: Number of pairs reached.
    """

    bodies: tuple[str, str]
    refused: int
    reached: int

    def to_json(self) -> dict[str, Any]:
        """Return the contact as plain containers."""
        return {"bodies": list(self.bodies), "refused": self.refused, "reached": self.reached}

    def advice(self, robot: RobotFile) -> str:
        """Return what the contact means and what to change in a robot file, in one line."""
        first, second = self.bodies
        limits = (
            "; pairs exempt within the soft limits only are checked under 'limits: hard'"
            if robot.limits == "hard" and any(g.limits == "soft" for g in robot.disabled_groups)
            else ""
        )
        return (
            f"contact of '{first}' with '{second}' of robot '{robot.name}' refuses "
            f"{self.refused:,} pairs of configuration and goal, more than the {self.reached:,} "
            "reached. If the two cannot touch, list them under disabled_groups, or reduce "
            f"self_margin ({robot.self_margin:g} m){limits}."
        )


def prevailing_self_contact(
    tables: Iterable[ScoreTable], robot_bodies: Collection[str]
) -> SelfContact | None:
    """Return the pair of robot bodies that refuses more goals than are reached, None without one.

    The scores hold a contact for every goal that the arm or the gripper is refused, so counting
    them costs milliseconds. A robot that moves freely refuses few goals by self-collision: with the
    shipped robots the most frequent pair refuses at most a fiftieth of the number reached. A pair
    whose shapes touch in every posture refuses nearly all that are within reach.

    Args:
        tables: Scores of every observed state.
        robot_bodies: Names of the robot's bodies.
    """
    refused: dict[tuple[str, str], int] = {}
    reached = 0
    for scores in tables:
        reached += int(scores.reached.sum())
        counts = np.zeros(len(scores.pair_names), dtype=np.int64)
        for rows in chunks(scores.reason, scores.pair):
            arm = np.isin(
                scores.reason[rows], (Reason.ARM_BLOCKED, Reason.GRIPPER_BLOCKED_BY_ROBOT)
            )
            counts += np.bincount(scores.pair[rows][arm], minlength=len(counts))
        for bodies, count in zip(scores.pair_names, counts.tolist(), strict=True):
            if bodies[1] in robot_bodies:
                refused[bodies] = refused.get(bodies, 0) + count
    if not refused:
        return None
    worst = max(refused, key=lambda bodies: refused[bodies])
    if refused[worst] < FEWEST or refused[worst] <= reached:
        return None
    return SelfContact(worst, refused[worst], reached)
