"""Requests of the service: the options of the command line, with the same names and defaults.

Metres and degrees: angles are in keys that end in `_deg`, except the third number of `here`. A
request names score files by the digest of their content, and tasks, environments and robots by the
names of `tcs list`. No field is a path.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from tcs.files.documents import Document, Entries, Number

FileId = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$", description="SHA-256 of a score file.")]
CatalogueName = Annotated[str, Field(pattern=r"^[_A-Za-z0-9-]{1,80}$")]
"""Name of a task, an environment or a robot; never a path."""
Text = Annotated[str, Field(max_length=1000)]
Goal = Annotated[int, Field(strict=True, ge=0)] | Text
"""Index of a goal, from 0, or its name."""
YamlText = Annotated[str, Field(max_length=1024**2)]
BasePose = tuple[Number, Number, Number]
"""x [m], y [m] and heading [deg] in the environment frame."""
Settings = Annotated[dict[str, Number], Field(max_length=100)]
"""Values of axes or joints: metres, or degrees under names that end in `_deg`."""
Frames = Annotated[dict[str, list[Number]], Field(max_length=100)]
"""Positions of body frames [m]: x, y, z, and a quaternion qw, qx, qy, qz where it is observed."""
ForbiddenRegion = Text | Annotated[list[tuple[Number, Number]], Entries]
"""Polygon on the floor as "X1 Y1, X2 Y2, X3 Y3, ..." or as a list of [x, y] [m]."""


class Observed(Document):
    """What is observed of the person."""

    observed: Settings = Field(default_factory=dict)
    frames: Frames = Field(default_factory=dict)


class Limited(Document):
    """Constraints on what may be scored or selected, as of `tcs.Constraints`."""

    only: Annotated[list[Text], Field(max_length=100)] = Field(default_factory=list)
    keep: Annotated[list[Text], Field(max_length=100)] = Field(default_factory=list)
    forbid: Annotated[list[ForbiddenRegion], Field(max_length=100)] = Field(default_factory=list)
    blocked: Annotated[list[Text], Field(max_length=100)] = Field(default_factory=list)


class State(Document):
    """The current state of robot and environment."""

    torso: Number = 0.0
    at: Settings = Field(default_factory=dict)


class TravelCosts(Document):
    """Costs of travel."""

    metre_weight: Number = 1.0
    turn_weight: Number = 0.0
    torso_weight: Number = 0.0
    axis_weight: Settings = Field(default_factory=dict)
    travel: Text = "straight"


class SelectRequest(TravelCosts, Limited, Observed, State):
    """Select the recommended set, or with weights that of greatest utility, as `tcs select`."""

    file: FileId
    here: BasePose | None = None
    """Current base pose; without it travel costs nothing."""
    alpha: Number = 1.0
    """This and the weights and penalties below: the utility decides if one is given."""
    beta: Number = 1.0
    gamma: Number = 0.05
    delta: Number = 0.0
    prefer: Annotated[list[Text], Field(max_length=100)] = Field(default_factory=list)
    top: Annotated[int, Field(strict=True, ge=1, le=100)] | None = None
    min_apart: Number = 0.5
    place_penalty: Number = 0.01
    environment_penalty: Number = 0.01
    preference_penalty: Number = 0.05
    max_members: Annotated[int, Field(strict=True, ge=1, le=3)] | None = None
    parking: tuple[Number, Number, Number] | None = None
    """By how much the robot may be off at every stop: x, y [m] and heading [deg]. Windows are those
    that the file holds: `tcs select FILE --parking` finds them and keeps them there."""
    executable: Annotated[bool, Field(strict=True)] = False
    """Count only goals to which a job `motions` of this file found a motion."""


class ExplainRequest(TravelCosts, Observed, State):
    """Explain why a goal is not reached, and find the cheapest change, as `tcs explain`."""

    file: FileId
    goal: Goal
    configuration: Annotated[int, Field(strict=True, ge=0)] | None = None
    here: BasePose | None = None
    arm: Text | None = None
    turn_weight: Number = 0.3
    torso_weight: Number = 1.0
    travel: Text = "around"


class FloorRequest(Observed):
    """Return the best scores at each base position in one state of the environment."""

    file: FileId
    state: Annotated[int, Field(strict=True, ge=0)] = 0


class OutcomeRequest(Observed, State):
    """Return what is reached from a base pose, goal by goal, and the place in words."""

    file: FileId
    here: BasePose
    best: Annotated[bool, Field(strict=True)] = False


class PostureRequest(State):
    """Return robot, person and furniture in space at a base pose, the arm at a goal."""

    file: FileId
    here: BasePose
    goal: Goal | None = None
    """The goal that the arm is at; the one of greatest dexterity by default."""
    arm: Annotated[list[Annotated[list[Number], Field(max_length=20)]], Field(max_length=1500)] = (
        Field(default_factory=list)
    )
    """Postures of the arm [rad or m], instead of that at the goal: a frame for each."""


class SceneRequest(Document):
    """Return the outlines of furniture, person and base from above, in each state; a job."""

    file: FileId
    state: Annotated[int, Field(strict=True, ge=0)] | None = None
    """The one state to outline; all by default."""


class ScoreRequest(Limited):
    """Score every initial configuration of a grid, as `tcs score`; a job."""

    task: CatalogueName | None = None
    task_yaml: YamlText | None = None
    environment: CatalogueName = "wheelchair"
    environment_yaml: YamlText | None = None
    robot: CatalogueName = "pr2"
    arms: Text | None = None
    measure: Text = "isotropy"
    approach: Annotated[bool, Field(strict=True)] | None = None
    paper: Annotated[bool, Field(strict=True)] = False
    rules: Text = "paper"
    same_environment: Annotated[bool, Field(strict=True)] = False
    max_members: Annotated[int, Field(strict=True, ge=1, le=3)] = 2
    at: Settings = Field(default_factory=dict)
    person: Annotated[dict[str, str | Number], Field(max_length=100)] | None = None


class Thinned(Document):
    """Fewer base positions, for a first answer."""

    every: Annotated[int, Field(strict=True, ge=1, le=4)] = 1
    """Score only every so many base positions along x and along y."""
    around: tuple[Number, Number] | None = None
    """Base position [m] whose nearest one of the grid is among those, with `every`."""


class ScoreHereRequest(ScoreRequest, Observed, Thinned):
    """Score the scene as it is observed now, as `tcs score --observed` or `--frames`; a job."""


class Move(Document):
    """How a thing is moved on the floor, along the axes of what it stands on."""

    x: Number = 0.0
    y: Number = 0.0
    turn_deg: Number = 0.0


class Piece(Document):
    """A piece of furniture on the floor, one of `tcs.model.scene.pieces.PIECES`."""

    piece: Text
    x: Number
    y: Number
    turn_deg: Number = 0.0


class RescoreRequest(State, Thinned):
    """Score the task of a score file again where its environment has been changed; a job."""

    file: FileId
    move: Annotated[dict[str, Move], Field(max_length=100)] = Field(default_factory=dict)
    add: Annotated[list[Piece], Field(max_length=20)] = Field(default_factory=list)
    joints: Settings = Field(default_factory=dict)
    forbid: Annotated[list[ForbiddenRegion], Field(max_length=100)] = Field(default_factory=list)
    only_state: Annotated[bool, Field(strict=True)] = False
    max_members: Annotated[int, Field(strict=True, ge=1, le=3)] = 2


class EvaluateRequest(Observed):
    """Evaluate the success of a set in randomly perturbed environments; a job."""

    file: FileId
    samples: Annotated[int, Field(strict=True, ge=1, le=100_000)] = 1000
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    select: Text | Annotated[list[int], Field(max_length=3)] = "best"
    members: Annotated[int, Field(strict=True, ge=1, le=2)] = 2
    body_collisions: Text | None = None


class PlanRequest(Observed, State):
    """Plan the motions that do the task from each stop of a set, as `tcs plan`; a job."""

    file: FileId
    here: BasePose | None = None
    exactly: Annotated[bool, Field(strict=True)] = False
    max_members: Annotated[int, Field(strict=True, ge=1, le=3)] | None = None
    configuration: Annotated[list[int], Field(max_length=3)] = Field(default_factory=list)
    order: Text = "best"
    jerk: Number | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0


class PopulationRequest(Observed):
    """Count the people of a population whom the best sets serve, as `tcs population`; a job."""

    file: FileId
    bodies: Annotated[int, Field(strict=True, ge=1, le=10_000)] = 1000
    sex: Text = "any"
    sets: Annotated[int, Field(strict=True, ge=1, le=100)] = 10
    min_apart: Number = 0.5
    errors: Annotated[bool, Field(strict=True)] = False
    seed: Annotated[int, Field(strict=True, ge=0)] = 0


class RefineRequest(Observed):
    """Refine the best sets between the grid points, as `tcs refine`; a job."""

    file: FileId
    objective: Text = "score"
    starts: Annotated[int, Field(strict=True, ge=1, le=100)] = 6
    rounds: Annotated[int, Field(strict=True, ge=1, le=1000)] = 40
    samples: Annotated[int, Field(strict=True, ge=1, le=10_000)] | None = None
    keep_success: Annotated[bool, Field(strict=True)] = True
    body_collisions: Text | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0


class MotionsRequest(Observed):
    """Find which goals can be done, in and out and back to rest, as `tcs motions`; a job."""

    file: FileId
    within: Number = 0.05
    pairs: Annotated[bool, Field(strict=True)] = False
    most: Annotated[int, Field(strict=True, ge=1)] | None = None
    sample: Annotated[int, Field(strict=True, ge=1)] | None = None
    seed: Annotated[int, Field(strict=True, ge=0)] = 0


JobRequest = (
    ScoreRequest
    | ScoreHereRequest
    | EvaluateRequest
    | PlanRequest
    | PopulationRequest
    | RefineRequest
    | MotionsRequest
    | RescoreRequest
    | SceneRequest
)
"""Requests that take longer than a moment: they become jobs."""
