"""Measure requests of the service over ROS 2: select, from a client of another process.

Usage: python benchmarks/ros2.py FILE [--requests 300] [--save]

FILE is a score file made by `tcs score`. The node is a process of its own; the client is pure Zenoh
and listens in place of the router of rmw_zenoh. A latency is from before the request is encoded
until its response is decoded. Measuring begins once the node has prepared what its first job needs.
"""

from __future__ import annotations

import json
import queue
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import zenoh
from service import Asked, processor_time, wait_until_idle
from table import cell, header, parser, row, save

from tcs.placement.store import load_scores
from tcs.service.ros.ros2_types import Ros2Types

WARM_UP = 20
SECONDS = 60.0
CALL = "tcs_msgs/srv/Call"


def main() -> int:
    """Run the measurement and print it; return 1 if a request was not answered."""
    command_line = parser(__doc__)
    command_line.add_argument("file", type=Path, metavar="FILE")
    command_line.add_argument("--requests", type=int, default=300)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header("eclipse-zenoh", "rosbags")
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    with zenoh.open(config(address)) as session:
        node = subprocess.Popen(
            [sys.executable, "-m", "tcs", "serve", "--ros2", "--router", address, options.file],
            stdout=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        try:
            assert node.stdout is not None
            digest = node.stdout.readline().split()[0]
            asked = Asked(load_scores(options.file), digest, options.seed)
            faults = measured(Client(session), asked, options.requests, node.pid)
        finally:
            node.terminate()
            node.wait()
    save(options)
    return 1 if faults else 0


def config(address: str) -> zenoh.Config:
    """Return the configuration of a session that others connect to."""
    made = zenoh.Config()
    made.insert_json5("mode", '"router"')
    made.insert_json5("scouting/multicast/enabled", "false")
    made.insert_json5("listen/endpoints", json.dumps([address]))
    return made


class Client:
    """Calls services of the node."""

    def __init__(self, session: zenoh.Session) -> None:
        """Call through a session."""
        self.session, self._types, self._number = session, Ros2Types(), 0

    def call(self, name: str, request: str, seconds: float = SECONDS) -> object | None:
        """Return the response of a service, or None if there is none within a time [s]."""
        self._number += 1
        key = f"0/{name}/tcs_msgs::srv::dds_::Call_/{self._types.hash_of(CALL)}"
        fields = self._types.make(f"{CALL}_Request", request=request)
        replies: queue.SimpleQueue[zenoh.Reply] = queue.SimpleQueue()
        self.session.get(
            key, replies.put, payload=self._types.encode(f"{CALL}_Request", fields),
            attachment=struct.pack("<qqB16s", self._number, time.time_ns(), 16, bytes(16)),
            timeout=seconds,
        )  # fmt: skip
        try:
            reply = replies.get(timeout=seconds)
        except queue.Empty:
            return None
        if reply.ok is None:
            return None
        return self._types.decode(f"{CALL}_Response", reply.ok.payload.to_bytes())


def measured(client: Client, asked: Asked, requests: int, pid: int) -> int:
    """Measure the latency of `select`; return the number of requests without an answer."""
    end = time.monotonic() + SECONDS
    while not found(client, asked):
        # The node announces its services after it has connected.
        assert time.monotonic() < end, "the node does not answer"
        time.sleep(0.1)
    wait_until_idle(pid)
    times, faults, before = [], 0, 0.0
    for number in range(WARM_UP + requests):
        if number == WARM_UP:
            before = processor_time(pid)
        body, begun = asked.body().decode(), time.perf_counter()
        answer = client.call("tcs/select", body)
        times.append(time.perf_counter() - begun)
        # A start that is enclosed by furniture is an answer as well.
        faults += answer is None
    busy = 1e3 * (processor_time(pid) - before) / requests
    p50, p99 = (1e3 * float(np.quantile(times[WARM_UP:], q)) for q in (0.5, 0.99))
    row("select, one client", f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, {faults} errors")
    cell("ros2", "select, one client", "p50", f"{p50:.1f} ms")
    cell("ros2", "select, one client", "p99", f"{p99:.1f} ms")
    cell("ros2", "select, one client", "errors", str(faults))
    row("  processor time of the node, each", f"{busy:.2f} ms")
    cell("ros2", "select, one client", "processor time each", f"{busy:.2f} ms")
    return faults


def found(client: Client, asked: Asked) -> bool:
    """Return whether the node answers and holds the file."""
    answer = client.session.liveliness().get("@ros2_lv/0/**/NN/**", timeout=1.0)
    if not any(True for _ in answer):
        return False
    # A request that is sent before the service is announced is lost.
    return client.call("tcs/select", asked.body().decode(), seconds=2.0) is not None


if __name__ == "__main__":
    sys.exit(main())
