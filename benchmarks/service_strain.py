"""Measure selections of one client while another one sends what takes a service long.

Usage: python benchmarks/service_strain.py FILE [--seconds 5] [--only NAME] [--source FOLDER]
    [--save]

FILE is a score file made by `tcs score`. One client sends a selection every 10 ms, first alone and
then while another process sends one of the requests below again and again for some seconds; of a
job, until it has ended. Nothing is prepared before. "memory" is how much more the process that
answers takes at most meanwhile; "a new client" how long one that connects last waits for its
selection. `--source` runs a server of another version of tcs.
"""

from __future__ import annotations

import dataclasses
import http.client
import json
import math
import multiprocessing
import pickle
import random
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from service import Asked, Served, served
from table import cell, header, parser, row, save

from tcs.files.joblib_file import write_joblib
from tcs.placement.store import load_scores, save_scores
from tcs.placement.store.encoding import encode

OCTETS = "application/octet-stream"
HERE = (1.4, -1.2, 180.0)
BETWEEN = 0.01
"""Pause between two selections [s]."""
LONGEST = 60.0
"""Longest wait for a selection, and for the end of a job [s]."""
CHUNKED = (
    b"POST /v1/select HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    b"Transfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n"
)


@dataclass(frozen=True)
class To:
    """Where requests are sent to."""

    port: int
    file: str
    path: Path

    def post(self, path: str, body: bytes, media_type: str = "application/json") -> bytes:
        """Send a request; return the answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=2 * LONGEST)
        try:
            connection.request("POST", path, body, {"Content-Type": media_type})
            return connection.getresponse().read()
        finally:
            connection.close()

    def connected(self) -> socket.socket:
        """Return a connection."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=LONGEST)


def trailers(to: To) -> None:
    """Send headers after a content, until the connection is closed."""
    with suppress(OSError), to.connected() as endless:
        endless.sendall(CHUNKED + b"0\r\n")
        while True:
            endless.sendall(100 * (b"X-More: " + b"x" * 1000 + b"\r\n"))


def half_sent(to: To) -> None:
    """Hold connections that send nothing, half of the headers, or half of the content."""
    held = []
    with suppress(OSError):
        for number in range(600):
            held.append(to.connected())
            held[-1].sendall((b"", b"GET /v1 HTTP", CHUNKED)[number % 3])
    time.sleep(LONGEST)


def regions(to: To) -> None:
    """Forbid four regions of 1,000 vertices each."""
    angles = np.linspace(0.0, 2.0 * math.pi, 1000, endpoint=False)
    radius = 1.0 + 0.3 * np.sin(40.0 * angles)
    region = np.column_stack([radius * np.cos(angles), radius * np.sin(angles)]).round(4)
    forbid = [(region + np.array((0.1 * i, 0.0))).tolist() for i in range(4)]
    to.post("/v1/select", json.dumps({"file": to.file, "here": HERE, "forbid": forbid}).encode())


def megabyte(to: To) -> None:
    """Send a megabyte of JSON."""
    numbers = [random.random() for _ in range(50_000)]
    to.post("/v1/select", json.dumps({"file": to.file, "frames": {"head": numbers}}).encode())


def colliding_keys(to: To) -> None:
    """Send a score file of 780 kB whose 60,000 keys are numbers with the same hash."""
    parts = [pickle.PROTO, b"\x04", pickle.EMPTY_DICT, pickle.MARK]
    for i in range(60_000):
        number = pickle.encode_long(i * sys.hash_info.modulus)
        parts += [pickle.LONG1, bytes([len(number)]), number, pickle.NONE]
    to.post("/v1/files", b"".join([*parts, pickle.SETITEMS, pickle.STOP]), OCTETS)


def upload(to: To) -> None:
    """Send as much as is accepted, which is no score file."""
    to.post("/v1/files", bytes(64 * 1024**2), OCTETS)


def claims(to: To) -> None:
    """Send a score file that has the same table two hundred times."""
    content = encode(load_scores(to.path))
    content["tables"] *= 200
    with tempfile.NamedTemporaryFile() as file:
        write_joblib(Path(file.name), content, "Score file")
        to.post("/v1/files", Path(file.name).read_bytes(), OCTETS)


def another_file(to: To) -> None:
    """Send a score file that differs from the others, and ask about it."""
    file = load_scores(to.path)
    file = dataclasses.replace(file, metadata={**file.metadata, "created": str(random.random())})
    with tempfile.NamedTemporaryFile() as stream:
        save_scores(stream.name, file)
        content = Path(stream.name).read_bytes()
    for _ in range(5):
        digest = json.loads(to.post("/v1/files", content, OCTETS))["file"]
        to.post("/v1/select", json.dumps({"file": digest, "travel": "around"}).encode())


def boxes(to: To) -> None:
    """Score once in an environment of 500 boxes, as it is observed."""
    lines = ["name: boxes", "title: Boxes", "based_on: wheelchair", "obstacles:"]
    for i in range(500):
        x, y = 3.0 + 0.3 * (i % 25), 3.0 + 0.3 * (i // 25)
        lines.append(f"  - {{name: box{i}, box: [0.1, 0.1, 0.1], xyz: [{x:.2f}, {y:.2f}, 0.5]}}")
    job(to, "score-here", {"task": "shaving", "environment_yaml": "\n".join(lines)})


def shipped(to: To) -> None:
    """Score once in an environment that ships, as it is observed."""
    job(to, "score-here", {"task": "feeding"})


def job(to: To, name: str, request: dict[str, object]) -> None:
    """Do a job, and wait until it has ended."""
    status = json.loads(to.post(f"/v1/{name}", json.dumps(request).encode()))
    end = time.monotonic() + LONGEST
    while status["state"] in ("queued", "running") and time.monotonic() < end:
        time.sleep(0.5)
        connection = http.client.HTTPConnection("127.0.0.1", to.port, timeout=2 * LONGEST)
        connection.request("GET", f"/v1/jobs/{status['job']}")
        status = json.loads(connection.getresponse().read())
        connection.close()
    print(f"  {name}: {status['state']} {status['problem'] or ''}", flush=True)


STRAINS: dict[str, Callable[[To], None]] = {
    "endless trailers": trailers,
    "600 connections, idle or half sent": half_sent,
    "forbid of 4 x 1,000 vertices": regions,
    "a megabyte of JSON": megabyte,
    "780 kB of colliding keys": colliding_keys,
    "64 MB that are no score file": upload,
    "a score file that claims much": claims,
    "other score files": another_file,
    "a scene of 500 boxes": boxes,
    "a scene that ships": shipped,
}
JOBS = (boxes, shipped)


def main() -> int:
    """Run every measurement and print it; return 1 if the server failed anywhere."""
    command_line = parser(__doc__)
    command_line.add_argument("file", type=Path, metavar="FILE")
    command_line.add_argument("--seconds", type=float, default=5.0)
    command_line.add_argument("--only", default="")
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--source", type=Path, metavar="FOLDER")
    options = command_line.parse_args()
    header("fastapi", "uvicorn")
    failed = False
    for name, strain in STRAINS.items():
        if options.only in name:
            with served(options.file, options.source, "--no-prepare") as server:
                asked = Asked(load_scores(options.file), server.digest, options.seed)
                measure(name, strain, server, asked, options.file, options.seconds)
            failed |= server.failed or server.traces > 0
    save(options)
    return int(failed)


def measure(
    name: str,
    strain: Callable[[To], None],
    server: Served,
    asked: Asked,
    path: Path,
    seconds: float,
) -> None:
    """Measure selections alone, and while another process strains the server."""
    to = To(server.port, server.digest, path)
    alone = list(selections(to, asked, time.monotonic() + seconds, lambda: True))
    # The answers of the first some are given by a thread.
    report(name, "alone", alone[50:])
    other = multiprocessing.get_context("spawn").Process(target=strained, args=(name, to, seconds))
    before = most = memory_of(server.pid)
    other.start()
    time.sleep(1.0)
    times = []
    end = time.monotonic() + (LONGEST if strain in JOBS else seconds)
    for taken in selections(to, asked, end, other.is_alive):
        times.append(taken)
        most = max(most, memory_of(server.pid))
    report(name, "meanwhile", times)
    text = f"{(most - before) / 1e6:.0f} MB"
    row(f"{name}, memory", text)
    cell("service_strain", name, "memory", text)
    begun = time.monotonic()
    with suppress(OSError):
        to.post("/v1/select", asked.body())
    text = f"{1e3 * (time.monotonic() - begun):.1f} ms"
    row(f"{name}, a new client", text)
    cell("service_strain", name, "a new client", text)
    other.terminate()
    other.join()


def strained(name: str, to: To, seconds: float) -> None:
    """Send requests for some seconds; a job once."""
    strain, end = STRAINS[name], time.monotonic() + 2.0 * seconds + 2.0
    while True:
        strain(to)
        if strain in JOBS or time.monotonic() > end:
            return


def selections(to: To, asked: Asked, end: float, is_wanted: Callable[[], bool]) -> Iterator[float]:
    """Yield how long each selection of a client takes [s]; infinity for one that is refused."""
    connection = http.client.HTTPConnection("127.0.0.1", to.port, timeout=2 * LONGEST)
    while time.monotonic() < end and is_wanted():
        body, begun = asked.body(), time.perf_counter()
        try:
            connection.request("POST", "/v1/select", body, {"Content-Type": "application/json"})
            response = connection.getresponse()
            response.read()
            # 422: a start that is enclosed by furniture.
            taken = time.perf_counter() - begun if response.status in (200, 422) else math.inf
        except (OSError, http.client.HTTPException):
            # Closed where there are too many connections; the next one is a new one.
            connection.close()
            taken = math.inf
        yield taken
        time.sleep(BETWEEN)
    connection.close()


def report(name: str, when: str, times: list[float]) -> None:
    """Print and record the latencies [s]."""
    answered = [taken for taken in times if taken < math.inf] or [math.inf]
    text = " / ".join(f"{1e3 * float(np.quantile(answered, q)):.2f}" for q in (0.5, 0.99, 1.0))
    refused = f"{sum(taken == math.inf for taken in times)} of {len(times)} refused"
    row(f"{name}, {when}, p50 / p99 / most", f"{text} ms, {refused}")
    cell("service_strain", name, f"{when} (p50 / p99 / most)", f"{text} ms, {refused}")


def memory_of(pid: int) -> int:
    """Return the memory that a process takes [bytes]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096


if __name__ == "__main__":
    sys.exit(main())
