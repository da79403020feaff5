"""What every adapter answers: the engine, a client over HTTP, and the tools of an assistant."""

from __future__ import annotations

import dataclasses
import importlib
import json
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import mcp
import numpy as np
import pytest
from anyio.from_thread import start_blocking_portal

import tcs
import tcs.errors
from tcs.errors import BusyError, NotFoundError, StoreError, TcsError
from tcs.output.words import choice_in_words
from tcs.placement.parking import with_windows
from tcs.placement.store import save_scores
from tcs.placement.tables import Reason, tc_manipulability, tc_reachability
from tcs.service import (
    Engine,
    EvaluateRequest,
    ExplainRequest,
    FileEntry,
    FloorRequest,
    JobStatus,
    Limits,
    MotionsRequest,
    OutcomeRequest,
    PlanRequest,
    PopulationRequest,
    PostureRequest,
    RefineRequest,
    ScoreHereRequest,
    ScoreRequest,
    SelectRequest,
)
from tcs.service.assistant import make_assistant_server
from tcs.service.client import Client
from tcs.service.http import Access, Server, make_application
from tcs.service.operations import OPERATIONS
from tcs.service.ros import FrameNames
from tcs.service.ros.ros1 import Ros1Node
from tcs.service.ros.ros1_types import ros1_modules, ros1_types
from tests.placement.store.example import METADATA, known_everywhere, score_file
from tests.service.ros2_peer import ros2_peers

# What is tested is what happens in the processes, or put in its place.
pytestmark = pytest.mark.usefixtures("in_process")

HERE = (1.4, -1.2, 180.0)


def raised(name, detail):
    """Return the error of a class; one of a name that is unknown takes more than its text."""
    return (TcsError if name == "UnknownNameError" else getattr(tcs.errors, name))(detail)


AT = {"bed_height": 0.0}
UNKNOWN = "0" * 64


@pytest.fixture(scope="module")
def engine():
    with Engine(Limits(queued_jobs=2, kept_jobs=3)) as engine:
        yield engine


@pytest.fixture(scope="module")
def client(engine):
    with (
        Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server,
        Client(server.url) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def assistant(engine):
    with (
        start_blocking_portal() as portal,
        portal.wrap_async_context_manager(
            mcp.Client(make_assistant_server(engine, job_seconds=0.0))
        ) as client,
    ):
        yield Assistant(engine, portal, client)


class ByName:
    """The methods of the engine by requests with a name; files are not sent."""

    def __init__(self, engine):
        self.add_file, self.content_of = engine.add_file, engine.content_of
        self.wait = engine.wait

    def __getattr__(self, name):
        def call(request=None):
            if request is not None and not isinstance(request, str):
                given = request.model_dump(mode="json", exclude_unset=True)
            else:
                given = {} if request is None else {"job": request}
            return self._called(name, given)

        return call

    def _called(self, name, given):
        raise NotImplementedError  # each transport of the contract has its own

    def catalogue(self):
        return self._called("list", {})

    def files(self):
        return [FileEntry(**entry) for entry in self._called("files", {})]

    def job(self, name):
        return JobStatus(**self._called("job", {"job": name}))

    def cancel(self, name):
        return JobStatus(**self._called("cancel", {"job": name}))

    def submit(self, request):
        tool = next(one.name for one in OPERATIONS if one.request is type(request))
        given = request.model_dump(mode="json", exclude_unset=True)
        return JobStatus(**self._called(tool.replace("-", "_"), given))


class Assistant(ByName):
    """Requests as tools of an assistant."""

    def __init__(self, engine, portal, client):
        super().__init__(engine)
        self._portal, self._client = portal, client

    def _called(self, name, given):
        result = self._portal.call(self._client.call_tool, name, given)
        content = json.loads(result.content[0].text)
        if result.is_error:
            assert "\n" not in content["detail"]
            raise raised(content["title"], content["detail"])
        return content


class Ros(ByName):
    """Requests as services of ROS; `call` sends a text to a service and returns its response."""

    def __init__(self, engine, call):
        super().__init__(engine)
        self._call = call

    def _called(self, name, given):
        response = self._call(name, json.dumps(given))
        if not response.success:
            assert "\n" not in response.detail
            raise raised(response.error, response.detail)
        return json.loads(response.answer)


@pytest.fixture(scope="module")
def ros1(engine, ros1_master):
    with Ros1Node(engine, FrameNames(), max_age=5.0), ros1_types() as types:
        rospy = ros1_modules().rospy

        def call(name, text):
            return rospy.ServiceProxy(f"/tcs/{name}", types.srv.Call)(text)

        yield Ros(engine, call)


@pytest.fixture(scope="module")
def ros2(engine):
    with ros2_peers(engine) as (_, peer):

        def call(name, text):
            return peer.call(f"/tcs/{name}", "tcs_msgs/srv/Call", request=text)

        yield Ros(engine, call)


# rospy leaves the sockets of its connections to the collector.
COLLECTED = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(
    params=["engine", "client", "assistant", pytest.param("ros1", marks=COLLECTED), "ros2"]
)
def service(request):
    """The engine, directly, over HTTP, as tools of an assistant and as a node of ROS."""
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def content(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("service") / "small.tcs"
    save_scores(path, score_file())
    return path.read_bytes()


@pytest.fixture
def file(service, content) -> str:
    return service.add_file(content).file


@pytest.fixture
def slow_job(monkeypatch):
    """Jobs that count to 1,000 until they are released; yields the function that releases them."""
    released = threading.Event()

    def score(*_arguments, on_progress, **_options):
        for done in range(1000):
            on_progress(done, 1000)
            if released.wait(0.01):
                return score_file(metadata={**METADATA, "timings": TIMINGS})
        raise AssertionError("not released")

    monkeypatch.setattr("tcs.placement.scoring.score", score)
    yield released.set
    released.set()


TIMINGS = dict.fromkeys(
    ("compile_seconds", "scoring_seconds", "sets_seconds", "total_seconds"), 0.5
)


def test_catalogue(service):
    assert "shaving" in [task["name"] for task in service.catalogue()["tasks"]]


def test_file_is_held_once_and_comes_back(service, content):
    entry = service.add_file(content)
    assert service.add_file(content) == entry
    assert (entry.task, entry.goals, entry.bytes) == ("shaving", 5, len(content))
    assert entry in service.files()
    assert service.content_of(entry.file) == content


@pytest.mark.parametrize("content", [b"", b"cos\nsystem\n(S'true'\ntR.", b"not a score file"])
def test_other_content_is_refused_without_a_path_of_the_server(service, content):
    with pytest.raises((StoreError, TcsError)) as caught:
        service.add_file(content)
    assert "/tmp" not in str(caught.value)
    assert "\n" not in str(caught.value)


def test_select_has_the_keys_of_the_command(service, file, content, tcs_json):
    answer = service.select(SelectRequest(file=file, here=HERE, at=AT, top=2))
    expected = tcs_json("select", "--here", *HERE, "--at", "bed_height=0", "--top", 2)
    answer.pop("seconds"), expected.pop("seconds")
    assert answer == expected


def test_windows_of_the_file_are_those_of_the_command(service, tmp_path):
    held = score_file()
    tcs.select(held, parking=(0.05, 0.05, 3.0), find_windows=known_everywhere)
    path = tmp_path / "windows.tcs"
    save_scores(path, with_windows(held))
    file = service.add_file(path.read_bytes()).file
    answer = service.select(SelectRequest(file=file, parking=(0.05, 0.05, 3.0)))
    choice = tcs.select(held, parking=(0.05, 0.05, 3.0))
    expected = choice_in_words(held, choice, None)
    answer.pop("seconds"), expected.pop("seconds")
    assert answer == expected
    assert all(member["window"]["yaw_deg"] == 5.0 for member in answer["members"])


def test_windows_that_the_file_lacks_are_not_found(service, file):
    with pytest.raises(TcsError, match="not known yet"):
        service.select(SelectRequest(file=file, parking=(0.05, 0.05, 3.0)))


def test_explain_has_the_keys_of_the_command(service, file, tcs_json):
    answer = service.explain(ExplainRequest(file=file, goal=2, configuration=7))
    assert answer == tcs_json("explain", "--goal", 3, "--configuration", 7)


def test_floor_has_the_scores_of_the_table(service, file):
    held, grid = score_file(), score_file().configurations
    floor = service.floor(FloorRequest(file=file, state=1))
    assert floor["states"] == [{"bed_height": 0.0}, {"bed_height": 0.1}]
    reachability = tc_reachability(held.nominal.scores.reached, held.nominal.scores.weights)
    at = grid.values(np.arange(grid.size))
    for i, x in enumerate(floor["x"]):
        for j, y in enumerate(floor["y"]):
            here = np.isclose(at["base_x"], x) & np.isclose(at["base_y"], y)
            here &= np.isclose(at["bed_height"], 0.1)
            assert floor["reachability"][i][j] == pytest.approx(reachability[here].max(), abs=1e-4)
    with pytest.raises(TcsError, match="no state 2"):
        service.floor(FloorRequest(file=file, state=2))


def test_outcome_is_that_of_the_nearest_configuration(service, file):
    held = score_file()
    scores, grid = held.nominal.scores, held.configurations
    member = grid.configuration(37).to_json()
    here = (member["base_x"] + 0.02, member["base_y"], member["base_yaw_deg"])
    asked = {"file": file, "here": here, "torso": member["torso"]}
    asked["at"] = {"bed_height": member["bed_height"]}
    outcome = service.outcome(OutcomeRequest(**asked))
    assert outcome["configuration"] == 37
    assert outcome["members"] == [member]
    assert [goal["reached"] for goal in outcome["goals"]] == scores.reached[37].tolist()
    assert [Reason[g["reason"].upper()] for g in outcome["goals"]] == scores.reason[37].tolist()
    assert outcome["sentence"].endswith(f"{scores.reached[37].sum()} of 5 places reached.")
    best = service.outcome(OutcomeRequest(**asked, best=True))
    at = grid.values(np.arange(grid.size))
    same = [np.isclose(at[name], at[name][37]) for name in ("base_x", "base_y", "bed_height")]
    values = tc_reachability(scores.reached, scores.weights) + tc_manipulability(
        scores.dexterity, scores.weights
    )
    expected = values[np.logical_and.reduce(same)].max()
    assert best["reachability"] + best["manipulability"] == pytest.approx(expected)
    with pytest.raises(TcsError, match="beyond the grid"):
        service.outcome(OutcomeRequest(**{**asked, "here": (9.0, 0.0, 0.0)}))


def test_a_file_that_is_not_held(service):
    with pytest.raises(NotFoundError, match="send it again"):
        service.select(SelectRequest(file=UNKNOWN, here=HERE))
    with pytest.raises(NotFoundError):
        service.submit(EvaluateRequest(file=UNKNOWN))
    with pytest.raises(NotFoundError):
        service.content_of(UNKNOWN)


def test_errors_of_the_library_keep_their_line(service, file):
    with pytest.raises(TcsError, match="There is no goal 9: task 'shaving' has 5"):
        service.explain(ExplainRequest(file=file, goal=9))
    with pytest.raises(TcsError, match="give 'configuration' or 'here'"):
        service.explain(ExplainRequest(file=file, goal=0, configuration=1, here=HERE))


def test_job_has_progress_and_a_result(service, slow_job):
    status = service.submit(ScoreRequest(task="shaving"))
    seen = []

    def on_progress(done, total):
        seen.append((done, total))
        if len(seen) == 2:
            slow_job()

    ended = service.wait(status.job, on_progress)
    assert ended.state == "done"
    assert seen[0][0] < seen[1][0] <= seen[1][1] == 1000
    assert ended.result["goals"] == 5
    held = service.add_file(service.content_of(ended.result["file"]))
    assert held.bytes == ended.result["file_bytes"]
    json.dumps(ended.result, allow_nan=False)


def test_jobs_are_cancelled_and_the_queue_is_bounded(service, slow_job):
    running, *waiting = [service.submit(ScoreRequest(task="shaving")) for _ in range(2)]
    while service.job(running.job).state != "running":
        time.sleep(0.01)
    waiting.append(service.submit(ScoreRequest(task="shaving")))
    with pytest.raises(BusyError, match="2 jobs are waiting"):
        service.submit(ScoreRequest(task="shaving"))
    assert [service.cancel(one.job).state for one in waiting] == ["cancelled"] * 2
    service.cancel(running.job)
    assert service.wait(running.job).state == "cancelled"
    assert service.job(running.job).result is None


JOBS_OF_SETS = {
    "tcs.placement.population.population": (
        PopulationRequest,
        {"bodies": 7, "sex": "female", "sets": 3, "errors": True, "seed": 5},
        lambda given: {
            "bodies": len(given["people"]),
            "sex": "any" if given["people"].is_male.any() else "female",
            "sets": given["top"].count,
            "errors": given["errors"],
            "seed": given["seed"],
        },
    ),
    "tcs.motion.refine": (
        RefineRequest,
        {
            "objective": "success",
            "starts": 2,
            "rounds": 3,
            "samples": 4,
            "keep_success": False,
            "body_collisions": "none",
        },
        lambda given: given,
    ),
    "tcs.motion.examine.examine": (
        MotionsRequest,
        {"within": 0.1, "most": 4, "sample": 3, "seed": 6},
        lambda given: given,
    ),
}


@pytest.mark.parametrize("function", JOBS_OF_SETS)
def test_jobs_of_sets_pass_their_options_on(service, file, function, monkeypatch):
    model, fields, of_arguments = JOBS_OF_SETS[function]
    called = {}

    def recorded(scored, people=None, **options):
        called.update(options, people=people, scored=scored)
        options["on_progress"](1, 2)
        raise TcsError("recorded.")

    module, _, name = function.rpartition(".")
    # Some modules have the name of their function, which their package hands on in their place.
    monkeypatch.setattr(importlib.import_module(module), name, recorded)
    status = service.wait(service.submit(model(file=file, **fields)).job)
    assert (status.state, status.problem) == ("failed", "recorded.")
    assert (status.done, status.total) == (1, 2)
    assert {key: of_arguments(called)[key] for key in fields} == fields
    assert called["table"] == called["scored"].nominal_index


def test_executable_sets_need_motions(service, file):
    with pytest.raises(NotFoundError, match="Find them with a job `motions`"):
        service.select(SelectRequest(file=file, here=HERE, at=AT, executable=True))


def test_failed_job_has_one_line(service, tmp_path):
    path = tmp_path / "unknown.tcs"
    save_scores(path, score_file(metadata={**METADATA, "task": "shavign"}))
    file = service.add_file(path.read_bytes()).file
    for request in (PlanRequest(file=file, configuration=[0]), EvaluateRequest(file=file)):
        status = service.wait(service.submit(request).job)
        assert status.state == "failed"
        assert "unknown task 'shavign'" in status.problem
        assert "\n" not in status.problem
    with pytest.raises(TcsError, match="'task' or 'task_yaml'"):
        service.submit(ScoreRequest())


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        ({"task": "shavign"}, "unknown task 'shavign'.*Did you mean 'shaving'"),
        ({"task": "shaving", "environment": "wheelchir"}, "unknown environment 'wheelchir'"),
        ({"task": "shaving", "robot": "pr3"}, "unknown robot 'pr3'"),
        ({"task": "shaving", "measure": "isotropi"}, "isotropi"),
        ({"task_yaml": "name: x", "robot": "pr3"}, "unknown robot 'pr3'"),
    ],
)
@pytest.mark.parametrize("request_of", [ScoreRequest, ScoreHereRequest])
def test_a_wrong_name_in_a_job_is_refused_when_it_is_sent(service, request_of, fields, problem):
    with pytest.raises(TcsError, match=problem):
        service.submit(request_of(**fields))


def test_goals_are_named_by_index_or_name(service, tmp_path):
    named = score_file()
    goals = [{"name": f"spot {letter}", "body_frame": "head"} for letter in "abcde"]
    path = tmp_path / "named.tcs"
    save_scores(path, dataclasses.replace(named, task={**named.task, "goals": goals}))
    file = service.add_file(path.read_bytes()).file
    by_index, by_name = (
        service.explain(ExplainRequest(file=file, goal=goal)) for goal in (2, "spot c")
    )
    assert by_index == by_name
    for request, ask in ((ExplainRequest, service.explain), (PostureRequest, service.posture)):
        rest = {"here": HERE} if request is PostureRequest else {}
        with pytest.raises(TcsError, match="unknown goal 'spot z'"):
            ask(request(file=file, goal="spot z", **rest))


def test_sent_documents_open_no_path(service):
    cases = {
        "environment_yaml": (
            "based_on: /etc/passwd\nname: x\ntitle: x\n",
            "based_on: wheelchair\nname: x\ntitle: x\nobstacles:\n"
            "  - {name: a, file: ../../../etc/hosts, xyz: [0, 0, 0]}\n",
        ),
        "task_yaml": ("- a list\n", "name: [1\n", "name: x\n", "nmae: x\n"),
    }
    for key, texts in cases.items():
        for text in texts:
            rest = {"task": "shaving"} if key == "environment_yaml" else {}
            status = service.wait(service.submit(ScoreRequest(**{key: text, **rest})).job)
            assert status.state == "failed"
            assert "/tmp" not in status.problem
            assert "passwd'" not in status.problem or "based_on" in status.problem


def test_files_that_were_sent_do_not_name_paths(service, tmp_path):
    path = tmp_path / "path.tcs"
    save_scores(path, score_file(metadata={**METADATA, "environment": "/etc/passwd"}))
    file = service.add_file(path.read_bytes()).file
    status = service.wait(service.submit(EvaluateRequest(file=file, samples=1)).job)
    assert "names its environment by a path" in status.problem


def test_requests_from_many_threads_are_answered_as_alone(service, file):
    places = [(0.25 * i - 2.0, *HERE[1:]) for i in range(16)]

    def answer(here):
        found = service.select(SelectRequest(file=file, here=here, at=AT))
        return json.dumps({**found, "seconds": 0})

    alone = [answer(here) for here in places]
    assert len(set(alone)) > 8
    with ThreadPoolExecutor(16) as pool:
        assert list(pool.map(answer, 3 * places)) == 3 * alone


@pytest.fixture
def tcs_json(content, tmp_path):
    """Function that returns what a command of the file prints with `--json`."""
    from typer.testing import CliRunner

    from tcs.cli.app import app

    path = tmp_path / "small.tcs"
    path.write_bytes(content)

    def run(verb, *words):
        done = CliRunner().invoke(app, [verb, str(path), *map(str, words), "--json"])
        assert done.exit_code == 0, done.output
        return json.loads(done.stdout)

    return run
