"""Measure requests of the service over HTTP: select alone, 50 clients at once, malformed requests.

Every request is of another state. Selections with the same weights share what does not depend on
the state; with weights drawn for each request they share nothing.

Usage: python benchmarks/service.py FILE [--clients 50] [--requests 200] [--rounds 5] [--pause 0.0]
    [--source FOLDER] [--save]

FILE is a score file made by `tcs score`. The server is a process of its own; the clients share this
process and write HTTP by hand, so that they take little of the processor. With `--pause`, a client
waits between its requests on average so long [s]; without, it sends the next at once, and the
latency is then the number of clients divided by the throughput. Every client sends its requests in
each round; with weights drawn, all rounds together have as many. Measuring begins once the server
has prepared what its first job needs. `--source` runs a server of another version of tcs.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from table import cell, header, parser, row, save, spread

from tcs.model.grid import Grid
from tcs.placement.store import ScoreFile, load_scores

MALFORMED = 1000
ALONE = 300
BETWEEN, IDLE = 2.0, 0.02
"""Interval between two looks at the server [s], and the fraction of it that counts as idle."""


def main() -> int:
    """Run every measurement and print it; return 1 if the server failed anywhere."""
    command_line = parser(__doc__)
    command_line.add_argument("file", type=Path, metavar="FILE")
    command_line.add_argument("--clients", type=int, default=50)
    command_line.add_argument("--requests", type=int, default=200)
    command_line.add_argument("--rounds", type=int, default=5)
    command_line.add_argument("--pause", type=float, default=0.0)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--source", type=Path, metavar="FOLDER")
    options = command_line.parse_args()
    header("fastapi", "uvicorn")
    with served(options.file, options.source) as server:
        asked = Asked(load_scores(options.file), server.digest, options.seed)
        asyncio.run(measured(server.port, asked, options, server.pid))
    row("tracebacks of the server, restarts", f"{server.traces}, {int(server.failed)}")
    cell("service", "tracebacks of the server", "measured", str(server.traces))
    save(options)
    return 1 if server.traces or server.failed else 0


@dataclass
class Served:
    """A server of a process of its own."""

    digest: str
    port: int
    pid: int
    traces: int = 0
    failed: bool = False


@contextmanager
def served(file: Path, source: Path | None, *options: str) -> Iterator[Served]:
    """Run a server that holds a file, once it has prepared what its first job needs.

    Args:
        file: The file.
        source: Folder with the package that serves; None for the one that is installed.
        *options: Further options of `tcs serve`.
    """
    environment = os.environ | ({} if source is None else {"PYTHONPATH": str(source.resolve())})
    with tempfile.TemporaryFile("w+") as log:
        server = subprocess.Popen(
            [sys.executable, "-P", "-m", "tcs", "serve", str(file.resolve()), "--port", "0",
             *options],
            stdout=subprocess.PIPE, stderr=log, text=True, env=environment,
        )  # fmt: skip
        try:
            assert server.stdout is not None
            digest = server.stdout.readline().split()[0]
            while "127.0.0.1:" not in (said := said_by(log)):
                time.sleep(0.1)
                if server.poll() is not None:
                    sys.exit(said)
            found = Served(digest, int(said.split("127.0.0.1:")[1].split(",")[0]), server.pid)
            wait_until_idle(server.pid)
            yield found
            found.failed = server.poll() is not None
        finally:
            server.terminate()
            server.wait()
        found.traces = said_by(log).count("Traceback")


def said_by(log: IO[str]) -> str:
    """Return what a server has printed so far."""
    log.seek(0)
    return log.read()


class Asked:
    """Requests at random states around the furniture."""

    def __init__(self, file: ScoreFile, digest: str, seed: int) -> None:
        """Send requests about a file that a server holds."""
        self.digest, self.rng = digest, random.Random(seed)
        grid: Grid = file.configurations
        first = grid.configuration(0).to_json()
        self.at = {k: v for k, v in first.items() if k != "torso" and not k.startswith("base_")}
        self.x = [float(v) for v in grid.axis("base_x").values[[0, -1]]]
        self.y = [float(v) for v in grid.axis("base_y").values[[0, -1]]]

    def body(self, *, weights: bool = False) -> bytes:
        """Return a valid request, with the default weights or with some of its own."""
        here = [*(self.rng.uniform(*span) for span in (self.x, self.y)), self.rng.uniform(0, 360)]
        body = {"file": self.digest, "here": here, "at": self.at}
        if weights:
            drawn = {"alpha": (0.5, 2.0), "beta": (0.5, 2.0), "gamma": (0.01, 0.2)}
            body |= {name: self.rng.uniform(*span) for name, span in drawn.items()}
        return json.dumps(body).encode()

    def malformed(self) -> bytes:
        """Return a request with some bytes replaced, cut off, or of another form."""
        body = bytearray(self.body())
        choice = self.rng.randrange(4)
        if choice == 0:
            return bytes(body[: self.rng.randrange(len(body))])
        if choice == 1:
            return b"[" * self.rng.randrange(1, 100_000)
        if choice == 2:
            odd = self.rng.choice([None, True, 1e308, "", [], {}, [[]], 2**70, "\u0000"])
            key = self.rng.choice(["here", "at", "top", "only", "forbid", "travel", "frames", "x"])
            return json.dumps({**json.loads(body), key: odd}).encode()
        for _ in range(self.rng.randrange(1, 8)):
            body[self.rng.randrange(len(body))] = self.rng.randrange(256)
        return bytes(body)


async def measured(port: int, asked: Asked, options: argparse.Namespace, pid: int) -> None:
    """Run the measurements against a server."""
    alone, _ = await client(port, [asked.body() for _ in range(ALONE)], 0.0)
    report("select, one client", [alone[20:]], 0)
    for weights in (False, True):
        await at_once(port, asked, options, pid, weights=weights)
    answered = 0
    for _ in range(MALFORMED):
        status = await once(port, asked.malformed())
        answered += status in (200, 404, 413, 422)
    row("malformed requests answered", f"{answered} of {MALFORMED}")
    cell("service", "malformed requests", "answered", f"{answered} of {MALFORMED}")


async def at_once(
    port: int, asked: Asked, options: argparse.Namespace, pid: int, *, weights: bool
) -> None:
    """Measure many clients, each request of another state; `weights`: with weights of its own."""
    name = f"select, {options.clients} clients at once" + (", weights drawn" if weights else "")
    each = max(1, options.requests // options.rounds) if weights else options.requests
    rounds, faults, busy, sent = [], 0, 0.0, 0
    for _ in range(options.rounds):
        bodies = [
            [asked.body(weights=weights) for _ in range(each)] for _ in range(options.clients)
        ]
        before = processor_time(pid)
        found = await asyncio.gather(*(client(port, some, options.pause) for some in bodies))
        busy += processor_time(pid) - before
        rounds.append([t for one, _ in found for t in one])
        sent += len(rounds[-1])
        faults += sum(one for _, one in found)
    report(name, rounds, faults)
    row("  processor time of the server, each", f"{1e3 * busy / sent:.2f} ms")
    cell("service", name, "processor time each", f"{1e3 * busy / sent:.2f} ms")


def report(name: str, rounds: list[list[float]], faults: int) -> None:
    """Print and record the latencies of each round [s]: the median of the rounds, and the range."""
    for column, quantile in (("p50", 0.5), ("p99", 0.99)):
        of_rounds = [float(np.quantile(times, quantile)) for times in rounds]
        text = spread(of_rounds, "ms", 1e3) if len(rounds) > 1 else f"{1e3 * of_rounds[0]:.2f} ms"
        row(f"{name}, {column}", text)
        cell("service", name, column, text)
    row(f"{name}, errors", str(faults))
    cell("service", name, "errors", str(faults))


async def client(port: int, bodies: list[bytes], pause: float) -> tuple[list[float], int]:
    """Send requests over one connection; return the latencies [s] and the number of errors."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    times, faults = [], 0
    for body in bodies:
        if pause:
            await asyncio.sleep(random.expovariate(1.0 / pause))
        begun = time.perf_counter()
        status = await answer(reader, writer, body)
        times.append(time.perf_counter() - begun)
        # 422: a start that is enclosed by furniture.
        faults += status not in (200, 422)
    writer.close()
    return times, faults


async def once(port: int, body: bytes) -> int:
    """Send one request over a connection of its own; return the status."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        return await answer(reader, writer, body)
    finally:
        writer.close()


async def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, body: bytes) -> int:
    """Send a request and read its response; return the status."""
    writer.write(
        b"POST /v1/select HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
        b"Content-Length: %d\r\n\r\n%s" % (len(body), body)
    )
    head = await reader.readuntil(b"\r\n\r\n")
    length = next(
        int(line.split(b":")[1])
        for line in head.lower().split(b"\r\n")
        if line.startswith(b"content-length")
    )
    await reader.readexactly(length)
    return int(head.split(b" ", 2)[1])


def wait_until_idle(pid: int) -> None:
    """Wait until a server has prepared what its first job needs, so that only requests are left."""
    before = -1.0
    while processor_time(pid) - before > IDLE * BETWEEN:
        before = processor_time(pid)
        time.sleep(BETWEEN)


def processor_time(pid: int) -> float:
    """Return the processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    sys.exit(main())
