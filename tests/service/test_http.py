"""The server over HTTP: errors as problems, limits, and who may ask."""

from __future__ import annotations

import asyncio
import json
import random
import socket
import sys
import threading
import time

import httpx
import pytest

from tcs.errors import OutputError, SelectionError, ServiceError
from tcs.placement.store import save_scores
from tcs.service import Engine, Limits, SelectRequest
from tcs.service.client import Client
from tcs.service.http import (
    Access,
    Server,
    checked_access,
    description,
    make_application,
    protocol,
)
from tcs.service.http.file_queues import QUEUES, QUICK, STREAK, FileQueues
from tcs.service.http.protocol import MOST_HEAD_BYTES, MOST_PIPELINED, BoundedProtocol
from tcs.service.limits import SMALL_REQUEST
from tcs.service.operations import OPERATIONS
from tests.placement.store.example import score_file

TOKEN = "a-token-of-24-characters"


@pytest.fixture(scope="module")
def engine():
    with Engine(Limits(request_bytes=20_000, file_bytes=100_000, request_seconds=0.5)) as engine:
        yield engine


@pytest.fixture(scope="module")
def server(engine):
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        yield server


@pytest.fixture(scope="module")
def http(server):
    # The first large request waits for a process that starts.
    with httpx.Client(base_url=server.url, trust_env=False, timeout=60.0) as http:
        yield http


@pytest.fixture(scope="module")
def valid(engine, tmp_path_factory) -> dict:
    path = tmp_path_factory.mktemp("http") / "small.tcs"
    save_scores(path, score_file())
    return {"file": engine.open_file(path).file, "here": [1.4, -1.2, 180], "at": {"bed_height": 0}}


def refused(response: httpx.Response, status: int) -> str:
    """Check that a response is a problem of one line; return the line."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["status"] == status
    assert "\n" not in response.json()["detail"]
    return response.json()["detail"]


def test_faults_are_located(http, valid):
    def detail(status=422, **changes):
        return refused(http.post("/v1/select", json={**valid, **changes}), status)

    assert detail(heer=1).startswith("request: unknown key 'heer'. Known: ")
    assert detail(heer=1).endswith("Did you mean 'here'?")
    assert detail(here=[1, 2]).startswith("request, field 'here[2]' is missing.")
    assert "field 'alpha' is 'a'" in detail(alpha="a")
    assert "field 'file'" in detail(file="../../etc/passwd")
    assert "no score file 000000000000..." in detail(404, file="0" * 64)
    assert refused(http.post("/v1/nothing", json={}), 404).startswith("there is no POST")
    assert refused(http.delete("/v1/select"), 404)
    assert "application/json" in refused(http.post("/v1/select", content=b"{}"), 422)


def test_sizes_and_times_are_limited(http, server, valid):
    assert "20,000 bytes" in refused(
        http.post("/v1/select", json={**valid, "only": ["x" * 900] * 40}), 413
    )
    assert "100,000 bytes" in refused(http.post("/v1/files", content=b"x" * 100_001), 413)
    address = httpx.URL(server.url)
    with socket.create_connection((address.host, address.port)) as slow:
        slow.sendall(
            b"POST /v1/select HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n"
            b"Content-Type: application/json\r\n\r\n{"
        )
        assert b"408" in slow.recv(4096)


def test_headers_without_an_end_are_refused(server):
    address = httpx.URL(server.url)
    line = b"X-More: " + b"x" * 1000 + b"\r\n"
    with socket.create_connection((address.host, address.port), timeout=20) as endless:
        endless.sendall(b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        with pytest.raises(ConnectionError):
            endless.sendall(line * (100 * MOST_HEAD_BYTES // len(line)))
    with socket.create_connection((address.host, address.port), timeout=20) as whole:
        for _ in range(3):
            # One connection may send any number of requests below the limit.
            whole.sendall(b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n" + 40 * line + b"\r\n")
            assert b"200 OK" in whole.recv(65536)


def connected(server, timeout: float = 20.0) -> socket.socket:
    """Return a connection to a server."""
    address = httpx.URL(server.url)
    end = time.monotonic() + timeout
    while True:
        try:
            return socket.create_connection((address.host, address.port), timeout=timeout)
        except ConnectionRefusedError:
            # The thread of the server does not listen yet.
            assert time.monotonic() < end
            time.sleep(0.01)


def received(connection: socket.socket) -> bytes:
    """Return what arrives until the connection is closed."""
    parts = []
    try:
        while part := connection.recv(65536):
            parts.append(part)
    except ConnectionError:
        pass
    return b"".join(parts)


CHUNKED = (
    b"POST /v1/select HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    b"Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n"
)


@pytest.mark.parametrize(
    "part",
    [b"X-More: " + b"x" * 1000 + b"\r\n", b"1;" + b"x" * 1000 + b"\r\n \r\n"],
    ids=["trailers", "extensions of chunks"],
)
def test_what_follows_or_divides_the_content_is_limited(server, part):
    first = b"0\r\n" if part.startswith(b"X") else b""
    with connected(server) as endless:
        endless.sendall(CHUNKED + first)
        with pytest.raises(ConnectionError):
            endless.sendall(part * (100 * MOST_HEAD_BYTES // len(part)))


def test_trailers_are_no_headers(server):
    with connected(server) as whole:
        # Otherwise what is checked before the content arrives could be changed after it.
        whole.sendall(CHUNKED + b"0\r\nHost: evil.example\r\n\r\n")
        assert b" 422 " in whole.recv(4096).splitlines()[0]


def test_a_refusal_closes_the_connection(server):
    with connected(server) as foreign:
        foreign.sendall(b"POST /v1/select HTTP/1.1\r\nHost: evil\r\nContent-Length: 9\r\n\r\n")
        answer = received(foreign)
    assert b" 403 " in answer.splitlines()[0]
    assert b"connection: close" in answer


def test_requests_that_wait_for_an_answer_are_limited(server):
    one = b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with connected(server) as some:
        some.sendall(MOST_PIPELINED * one)
        time.sleep(0.05)
        some.sendall(one[:-2] + b"Connection: close\r\n\r\n")
        assert received(some).count(b"200 OK") == MOST_PIPELINED + 1
    with connected(server) as many:
        many.sendall(10 * MOST_PIPELINED * one)
        assert b"Too many requests" in received(many)


def test_connections_that_send_nothing_keep_nobody_out(engine, monkeypatch):
    monkeypatch.setattr(protocol, "MOST_CONNECTIONS", 8)
    half = (b"", b"GET /v1 HTTP", CHUNKED)
    access = Access(token=TOKEN)
    with Server(make_application(engine, access), host="127.0.0.1", port=0) as server:
        idle = []
        for i in range(24):
            idle.append(connected(server))
            idle[-1].sendall(half[i % 3])
        with Client(server.url, token=TOKEN) as client:
            assert client.catalogue()
        # The first have been closed, the last have not; what lacks the token is answered at once.
        assert received(idle[0]) == received(idle[1]) == b""
        assert b" 401 " in received(idle[23])
        for one in idle:
            one.close()


def test_half_a_head_is_not_waited_for(engine, monkeypatch):
    monkeypatch.setattr(protocol, "HEAD_SECONDS", 0.2)
    monkeypatch.setattr("tcs.service.http.server._KEEP_ALIVE", 0.2)
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        for begun in (b"", b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n"):
            with connected(server) as half:
                half.sendall(begun)
                assert received(half) == b""
            with connected(server) as second:
                second.sendall(b"GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" + begun)
                assert b"200 OK" in received(second)


def test_contents_that_do_not_arrive_take_no_place(engine, monkeypatch):
    monkeypatch.setattr(Engine, "limits", Limits(requests_at_once=1))
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        with connected(server) as half, connected(server) as other:
            half.sendall(CHUNKED)
            other.sendall(CHUNKED)
            time.sleep(0.05)
            assert httpx.get(f"{server.url}/v1", trust_env=False).status_code == 200


def test_an_aborted_upload_is_no_defect(server, caplog):
    with connected(server) as aborted:
        aborted.sendall(b"POST /v1/files HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\nx")
        time.sleep(0.05)
    httpx.get(f"{server.url}/v1", trust_env=False)
    time.sleep(0.05)
    assert caplog.records == []


def test_contents_are_limited_together(engine, monkeypatch):
    monkeypatch.setattr(Engine, "limits", Limits(request_bytes=1000, content_bytes=5000))
    large = b"POST /v1/files HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9000\r\n\r\n"
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        with connected(server) as first, connected(server) as second:
            first.sendall(large + b"x" * 4000)
            time.sleep(0.05)
            second.sendall(large + b"x" * 4000)
            assert b" 503 " in received(second).splitlines()[0]
            assert httpx.get(f"{server.url}/v1", trust_env=False).status_code == 200


def test_a_large_content_is_not_copied_as_a_whole(engine, monkeypatch):
    content, sent = random.Random(0).randbytes(5_000_000), []
    monkeypatch.setattr(Engine, "limits", Limits())
    monkeypatch.setattr(engine, "add_file", lambda parts: sent.extend(parts) or engine.files())
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        httpx.post(f"{server.url}/v1/files", content=content, trust_env=False)
    assert b"".join(sent) == content
    # Copying megabytes would keep all other requests waiting.
    assert max(map(len, sent)) < 2 * 1024**2


def burn(seconds: float) -> None:
    """Take time of the processor."""
    end = time.thread_time() + 1.01 * seconds
    while time.thread_time() < end:
        pass


def test_a_large_body_is_no_head(http, server):
    # The content may arrive together with the headers, in one part that is larger than a head.
    large = json.dumps({"only": ["x" * 900] * 90})
    assert len(large) > MOST_HEAD_BYTES
    head = (
        "POST /v1/select HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        f"Content-Length: {len(large)}\r\n\r\n"
    )
    address = httpx.URL(server.url)
    with socket.create_connection((address.host, address.port), timeout=20) as whole:
        whole.sendall((head + large).encode())
        assert b" 413 " in whole.recv(4096).splitlines()[0]


def test_quick_answers_need_no_thread_and_wait_for_no_slow_one():
    threads: list[bool] = []

    def quick() -> None:
        threads.append(threading.current_thread() is threading.main_thread())

    def slow() -> None:
        quick()
        burn(QUICK)

    async def ask() -> None:
        queues, file = FileQueues(), "0" * 64
        for _ in range(STREAK):
            await queues.run(file, "quick", quick)
        assert not any(threads)
        await queues.run(file, "quick", quick)
        assert threads.pop()
        waiting = asyncio.ensure_future(queues.run(file, "slow", slow))
        await asyncio.sleep(0)
        # The engine would let it wait for the other one: not where all connections wait with it.
        await queues.run(file, "quick", quick)
        assert waiting.done()
        await queues.run("1" * 64, "slow", slow)
        assert not any(threads)
        await queues.run(file, "quick", slow)
        await queues.run(file, "quick", quick)
        assert threads[-2:] == [True, False]

    asyncio.run(ask())


def test_requests_about_a_file_are_answered_in_their_order():
    answered, threads = [], set()

    def answer(file: str, number: int) -> tuple[str, int]:
        time.sleep(0.001 * (number % 3))
        burn(QUICK)
        threads.add(threading.get_ident())
        answered.append((file, number))
        return file, number

    async def ask() -> list[tuple[str, int]]:
        queues = FileQueues()
        sent = [(f"{file:064x}", number) for number in range(20) for file in range(6)]
        waiting = [queues.run(one[0], "kind", lambda one=one: answer(*one)) for one in sent]
        assert await asyncio.gather(*waiting) == sent
        return sent

    sent = asyncio.run(ask())
    for file in {one for one, _ in sent}:
        assert [number for one, number in answered if one == file] == list(range(20))
    assert len(threads) <= QUEUES


def test_results_are_passed_on_as_they_are(http, engine):
    # Reading and writing megabytes would keep every other request waiting.
    text = '{"x":   [1.50, 2]}'
    job = engine._jobs.submit("plan", lambda _: text).job
    assert engine.wait(job).result == {"x": [1.5, 2]}
    found = http.get(f"/v1/jobs/{job}")
    assert f'"result": {text}' in found.text
    assert found.json() == engine.job(job).model_dump()
    assert http.delete(f"/v1/jobs/{job}").json() == found.json()
    events = http.get(f"/v1/jobs/{job}/events").text
    assert events == f"event: end\ndata: {found.text}\n\n"
    assert [one["result"] for one in http.get("/v1/jobs").json() if one["job"] == job] == [None]


def test_who_waits_for_a_scene_takes_no_thread_from_others(server, engine, valid, monkeypatch):
    released = threading.Event()
    monkeypatch.setattr(engine, "answer_apart", lambda *_: str(released.wait(60.0)).lower())
    body = json.dumps({"file": valid["file"], "here": valid["here"]}).encode()
    head = (
        "POST /v1/posture HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        f"Connection: close\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    # More than there are threads.
    waiting = [connected(server) for _ in range(50)]
    try:
        for one in waiting:
            one.sendall(head.encode() + body)
        time.sleep(0.1)
        found = httpx.get(f"{server.url}/v1/list", timeout=5.0, trust_env=False)
        assert found.status_code == 200
    finally:
        released.set()
        answers = [received(one) for one in waiting]
        for one in waiting:
            one.close()
    assert all(one.endswith(b"true") for one in answers)


def test_the_description_is_not_made_where_requests_are_answered(engine, monkeypatch):
    threads, schemas = [], description.schemas
    monkeypatch.setattr(
        description, "schemas", lambda: threads.append(threading.current_thread()) or schemas()
    )
    with Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server:
        for path in ("/docs", "/openapi.json", "/docs"):
            assert httpx.get(f"{server.url}{path}", trust_env=False).status_code == 200
    assert [thread.name for thread in threads] != ["tcs-http"]
    assert len(threads) == 1


def test_too_many_requests_at_once_are_refused(engine, monkeypatch):
    few = Limits(requests_at_once=0)
    monkeypatch.setattr(Engine, "limits", few)
    with (
        Server(make_application(engine, Access()), host="127.0.0.1", port=0) as server,
        httpx.Client(base_url=server.url, trust_env=False) as http,
    ):
        response = http.get("/v1")
    refused(response, 503)
    assert response.headers["retry-after"] == "1"


def test_pages_of_other_servers_are_refused(http):
    assert http.get("/v1").status_code == 200
    refused(http.get("/v1", headers={"Origin": "http://evil.example"}), 403)
    refused(http.get("/v1", headers={"Host": "evil.example"}), 403)


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_what_pages_of_other_servers_embed_or_open_is_refused(http, site):
    # A browser sends no Origin with pictures, frames and links.
    fetched = {"Sec-Fetch-Site": site, "Sec-Fetch-Dest": "iframe"}
    for path in (f"/v1/files/{'0' * 64}/report", f"/v1/files/{'0' * 64}/view", "/docs", "/"):
        refused(http.get(path, headers=fetched), 403)
    # A shared link to the page may stand anywhere; this server has no page.
    refused(http.get("/", headers={**fetched, "Sec-Fetch-Dest": "document"}), 404)
    refused(http.get("/v1/files", headers={**fetched, "Sec-Fetch-Dest": "document"}), 403)
    assert http.get("/v1", headers={"Sec-Fetch-Site": "same-origin"}).status_code == 200
    assert http.get("/v1", headers={"Sec-Fetch-Site": "none"}).status_code == 200


def test_pages_run_nothing_that_asks_or_sends(http, engine, valid, monkeypatch):
    page = "<!doctype html><script>1</script>"
    monkeypatch.setattr(engine, "report_of", lambda file: page)
    monkeypatch.setattr(engine, "view_of", lambda file: page)
    policies = {
        path: http.get(path).headers["content-security-policy"]
        for path in (
            "/v1", "/docs", f"/v1/files/{valid['file']}/report", f"/v1/files/{valid['file']}/view",
            "/v1/files/" + "0" * 64,
        )
    }  # fmt: skip
    for path, policy in policies.items():
        assert policy.startswith("default-src 'none'; "), path
        # Without an origin, a script in the page can ask nothing of this server.
        assert "sandbox" in policy, path
        assert "allow-same-origin" not in policy, path
        assert "http" not in policy, path
        assert ("connect-src data: blob:" in policy) == path.endswith("/view")


def test_token(engine, valid):
    access = Access(token=TOKEN)
    with Server(make_application(engine, access), host="127.0.0.1", port=0) as server:
        with httpx.Client(base_url=server.url, trust_env=False) as http:
            assert "Authorization" in refused(http.get("/v1"), 401)
            refused(http.get("/v1", headers={"Authorization": "Bearer no"}), 401)
        with Client(server.url, token=TOKEN) as client:
            assert client.select(SelectRequest(**valid))["members"]


def test_only_this_machine_without_a_token():
    with pytest.raises(ServiceError, match="can be reached from other machines"):
        checked_access("0.0.0.0", None)
    with pytest.raises(ServiceError, match="at least 16 characters"):
        checked_access("0.0.0.0", "short")
    assert checked_access("0.0.0.0", TOKEN).token == TOKEN
    assert checked_access("::1", None).token is None


def test_answers_are_sent_at_once(server, monkeypatch):
    # Otherwise the body of an answer waits until the client has acknowledged its head, some 40 ms.
    at_once, connection_made = [], BoundedProtocol.connection_made

    def connected(protocol, transport):
        connection = transport.get_extra_info("socket")
        at_once.append(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        connection_made(protocol, transport)

    monkeypatch.setattr(BoundedProtocol, "connection_made", connected)
    httpx.get(f"{server.url}/openapi.json")
    assert at_once
    assert all(at_once)


def test_port_in_use_is_one_line(server):
    with pytest.raises(OutputError, match="Give another one with --port"):
        Server(None, host="127.0.0.1", port=httpx.URL(server.url).port)


def test_description_names_every_request_and_loads_nothing(http):
    description = http.get("/openapi.json").json()
    assert {"/v1/select", "/v1/score-here", "/v1/jobs/{job}/events"} <= set(description["paths"])
    known = description["components"]["schemas"]
    for path in description["paths"].values():
        for one in path.values():
            for name in json.dumps(one).split("#/components/schemas/")[1:]:
                assert name.partition('"')[0] in known
    page = http.get("/docs").text
    assert "POST /v1/select" in page
    assert "src=" not in page
    assert "//" not in page.replace("http://127.0.0.1:8000", "").replace("<!", "")


def malformed(rng: random.Random, valid: dict) -> tuple[str, bytes]:
    """Return a request that is not valid, or only by chance."""
    content = json.dumps(valid).encode()
    path = rng.choice(["/v1/select", "/v1/explain", "/v1/score", "/v1/files", "/v1/plan"])
    change = rng.randrange(5)
    if change == 0:
        cut = bytearray(content)
        for _ in range(rng.randrange(1, 6)):
            cut[rng.randrange(len(cut))] = rng.randrange(256)
        return path, bytes(cut)
    if change == 1:
        return path, content[: rng.randrange(len(content))]
    odd = [None, True, -1, 1e308, "", "x" * 2000, [], {}, [[]], {"a": None}, "\u0000", 2**70]
    key = rng.choice([*valid, "goal", "top", "only", "forbid", "blocked", "travel", "frames", "x"])
    if change == 2:
        return path, b"[" * rng.randrange(1, 20_000)
    return path, json.dumps({**valid, key: rng.choice(odd)}).encode()


def test_malformed_requests_are_answered(http, valid, caplog):
    rng = random.Random(0)
    for _ in range(150):
        path, content = malformed(rng, valid)
        response = http.post(path, content=content, headers={"Content-Type": "application/json"})
        assert response.status_code in (200, 202, 404, 422, 413, 503), (path, content)
        if response.status_code != 200 and response.status_code != 202:
            refused(response, response.status_code)
    assert [record for record in caplog.records if record.exc_info] == []


def test_the_work_of_a_request_is_known_where_it_depends_on_the_file_alone(valid):
    select = next(one for one in OPERATIONS if one.name == "select")

    def kind(**fields):
        return select.kind_of(SelectRequest(**{**valid, **fields}))

    assert kind() == kind(here=(0.0, 0.0, 0.0), torso=0.1) is not None
    assert kind(alpha=0.5) != kind(alpha=0.6)
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]
    for fields in ({"forbid": [square]}, {"travel": "around"}, {"top": 3}, {"only": ["torso < 1"]}):
        assert kind(**fields) is None
    assert [one.name for one in OPERATIONS if one.bounded] == ["select"]


def test_regions_have_a_number_of_vertices_together(engine, valid):
    polygon = [(0.001 * i, (i % 2) / 2) for i in range(1000)]
    with pytest.raises(SelectionError, match="'forbid': the regions have 6,000 vertices; at most"):
        engine.select(SelectRequest(**valid, forbid=[polygon] * 6))


def test_large_requests_are_read_in_another_process(http, engine, valid, monkeypatch):
    called = []
    call = engine._parsing.call
    monkeypatch.setattr(
        engine._parsing,
        "call",
        lambda *given, **options: called.append(given) or call(*given, **options),
    )
    small = http.post("/v1/select", json=valid)
    assert (small.status_code, called) == (200, [])
    spaces = json.dumps(valid) + " " * SMALL_REQUEST
    large = http.post("/v1/select", content=spaces, headers={"Content-Type": "application/json"})
    assert len(called) == 2
    assert {**large.json(), "seconds": 0} == {**small.json(), "seconds": 0}
    refused(http.post("/v1/select", json={**valid, "x" * SMALL_REQUEST: 1}), 422)


def test_paths_around_the_furniture_are_sought_in_another_process(http, engine, valid, monkeypatch):
    """The search lets no thread of its process go on."""
    called, call = [], engine.answer_apart
    monkeypatch.setattr(
        engine, "answer_apart", lambda name, request: called.append(name) or call(name, request)
    )
    for fields, expected in (({}, []), ({"travel": "around"}, ["select"])):
        found = http.post("/v1/select", json={**valid, **fields})
        assert called == expected
        request = SelectRequest(**valid, **fields)
        assert {**found.json(), "seconds": 0} == {**engine.select(request), "seconds": 0}
    # It goes around the furniture by default; there may be no such path.
    assert http.post("/v1/explain", json={**valid, "goal": 0}).status_code in (200, 422)
    assert called == ["select", "explain"]


def test_the_thread_that_answers_has_its_turn_soon(http):
    assert http.get("/v1").status_code == 200
    assert sys.getswitchinterval() < 0.0025


def test_files_are_listed_while_another_one_is_read(http, engine, monkeypatch):
    reading, may_end, call = threading.Event(), threading.Event(), engine._parsing.call

    def slow(*given, **options):
        reading.set()
        assert may_end.wait(60.0)
        return call(*given, **options)

    monkeypatch.setattr(engine._parsing, "call", slow)
    sending = threading.Thread(target=lambda: http.post("/v1/files", content=b"none"))
    sending.start()
    try:
        assert reading.wait(60.0)
        assert http.get("/v1/files", timeout=5.0).status_code == 200
    finally:
        may_end.set()
        sending.join()
