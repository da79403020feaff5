"""A client of ROS 2 that is pure Zenoh: its keys and attachments are written out by hand."""

from __future__ import annotations

import json
import socket
import struct
import threading
import time
from contextlib import contextmanager

import zenoh

from tcs.service.ros import FrameNames
from tcs.service.ros.ros2 import Ros2Node
from tcs.service.ros.ros2_types import Ros2Types

SECONDS = 20.0


def config(verb: str, port: int) -> zenoh.Config:
    """A session that listens at or connects to a port of this machine, and looks for no other."""
    made = zenoh.Config()
    made.insert_json5("mode", '"peer"')
    made.insert_json5("scouting/multicast/enabled", "false")
    made.insert_json5("timestamping/enabled", "true")
    made.insert_json5("listen/endpoints", "[]")
    made.insert_json5(f"{verb}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    return made


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


@contextmanager
def ros2_peers(engine, names=FrameNames(), **options):  # noqa: B008
    """A node and a client of it."""
    port = free_port()
    with (
        Ros2Node(engine, names, config("listen", port), max_age=5.0, **options) as node,
        Peer(port) as peer,
    ):
        yield node, peer


class Peer:
    """Calls services, and reads and writes topics."""

    def __init__(self, port: int):
        self.types, self.number, self.gid = Ros2Types(), 0, bytes(range(16))
        self.session = zenoh.open(config("connect", port))
        self.declared = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.session.close()

    def key(self, name, type_, hash_=None):
        package, part, short = type_.split("/")
        hash_ = hash_ or self.types.hash_of(type_)
        return f"0/{name.strip('/')}/{package}::{part}::dds_::{short}_/{hash_}"

    def send(self, name, type_, /, **fields):
        """Send a request; return a function that waits for the response."""
        self.number += 1
        request = self.types.make(f"{type_}_Request", **fields)
        attachment = struct.pack("<qq", self.number, time.time_ns()) + b"\x10" + self.gid
        replies, number = [], self.number
        arrived = threading.Event()

        def on_reply(reply):
            replies.append(reply)
            arrived.set()

        self.session.get(
            self.key(name, type_),
            on_reply,
            payload=self.types.encode(f"{type_}_Request", request),
            attachment=attachment,
            timeout=SECONDS,
        )

        def wait():
            assert arrived.wait(SECONDS), f"{name} does not answer"
            (reply,) = replies
            back = reply.ok.attachment.to_bytes()
            # The number and the sender come back: rmw_zenoh finds the request by them.
            assert struct.unpack("<q", back[:8]) == (number,)
            assert back[16:] == b"\x10" + self.gid
            return self.types.decode(f"{type_}_Response", reply.ok.payload.to_bytes())

        return wait

    def call(self, name, type_, /, **fields):
        return self.send(name, type_, **fields)()

    def subscribe(self, name, type_):
        """Return a list that grows by the messages of a topic."""
        found = []

        def on_sample(sample):
            found.append(self.types.decode(type_, sample.payload.to_bytes()))

        key = self.key(name, type_)
        options = {"history": zenoh.ext.HistoryConfig(detect_late_publishers=True)}
        self.declared.append(
            zenoh.ext.declare_advanced_subscriber(self.session, key, on_sample, **options)
        )
        return found

    def publisher(self, name, type_, *, latched=False):
        options = {}
        if latched:
            options = {"cache": zenoh.ext.CacheConfig(1), "publisher_detection": True}
        made = zenoh.ext.declare_advanced_publisher(self.session, self.key(name, type_), **options)

        def publish(message):
            attachment = struct.pack("<qq", 1, time.time_ns()) + b"\x10" + self.gid
            made.put(self.types.encode(type_, message), attachment=attachment)

        return publish
