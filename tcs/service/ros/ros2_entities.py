"""Nodes, services and topics of ROS 2 on Zenoh, as rmw_zenoh maps them; requires `tcs[ros2]`.

Source:
    Keys, attachments and liveliness tokens: design.md of github.com/ros2/rmw_zenoh.
"""

from __future__ import annotations

import itertools
import json
import logging
import os
import secrets
import struct
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import zenoh
import zenoh.ext

from tcs.errors import ServiceError
from tcs.service.ros.ros2_types import Ros2Types

_LOG = logging.getLogger(__name__)
_THREADS = 16
"""Most requests that are answered at the same time; others wait."""
_ENCODING = zenoh.Encoding("application/cdr")
_VOLATILE = "::,10:,:,:,,"
"""Quality of service of a token: reliable, volatile, the last ten kept."""
_LATCHED = ":1:,1:,:,:,,"
"""Reliable, transient local, the last one kept."""
_ATTACHMENT = struct.Struct("<qqB16s")


def zenoh_config(router: str) -> zenoh.Config:
    """Return the configuration of a session of ROS 2.

    Args:
        router: Address of the router, e.g. "tcp/localhost:7447". The file that the environment
            variable `ZENOH_SESSION_CONFIG_URI` names is taken in its place, as by rmw_zenoh.

    Raises:
        ServiceError: If the address or the file cannot be used.
    """
    path = os.environ.get("ZENOH_SESSION_CONFIG_URI")
    try:
        if path:
            return zenoh.Config.from_file(path)
        config = zenoh.Config()
        config.insert_json5("mode", '"peer"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("connect/endpoints", json.dumps([router]))
        config.insert_json5("connect/timeout_ms", "0")
    except zenoh.ZError as error:
        text = " ".join(str(error).split())
        raise ServiceError(f"Zenoh cannot be configured ({path or router}): {text}") from None
    return config


class Ros2Session:
    """A node of ROS 2: declares services, publishers and subscribers."""

    def __init__(self, config: zenoh.Config, types: Ros2Types, name: str, domain: int) -> None:
        """Open the session and announce the node.

        Args:
            config: Configuration of Zenoh.
            types: The types of messages.
            name: Name of the node.
            domain: Number of the domain, `ROS_DOMAIN_ID`.

        Raises:
            ServiceError: If the session cannot be opened.
        """
        self.types, self._name, self._domain = types, name, domain
        self._stack = ExitStack()
        # What is kept for later subscribers is ordered by time.
        config.insert_json5("timestamping/enabled", "true")
        try:
            self._session = self._stack.enter_context(zenoh.open(config))
        except zenoh.ZError as error:
            raise ServiceError(f"Zenoh cannot open: {' '.join(str(error).split())}") from None
        self._threads = self._stack.enter_context(ThreadPoolExecutor(_THREADS))
        self._numbers = itertools.count(1)
        self._declarations: list[Any] = []
        self._announce(f"0/0/NN/%/%/{name}")

    def close(self) -> None:
        """End every service, and close the session."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._stack.close()

    def add_service(self, name: str, type_: str, answer: Callable[[Any], Any]) -> None:
        """Answer the requests of a service, several at the same time.

        Args:
            name: Name of the service, e.g. "/tcs/select".
            type_: Name of its type, e.g. "tcs_msgs/srv/Call".
            answer: Returns the response to a request, or a future of it, for which no thread waits.
        """
        key = self._declared("SS", name, type_, _VOLATILE)

        def send(query: zenoh.Query, number: int, gid: bytes, response: Any) -> None:
            data = self.types.encode(f"{type_}_Response", response)
            stamp = _ATTACHMENT.pack(number, time.time_ns(), len(gid), gid)
            query.reply(key, data, encoding=_ENCODING, attachment=stamp)
            _drop(query)

        def reply(query: zenoh.Query) -> None:
            try:
                if query.payload is None or query.attachment is None:
                    _drop(query)
                    return
                number, _, _, gid = _ATTACHMENT.unpack(query.attachment.to_bytes())
                found = answer(self.types.decode(f"{type_}_Request", query.payload.to_bytes()))
                if isinstance(found, Future):
                    found.add_done_callback(lambda done: send(query, number, gid, done.result()))
                else:
                    send(query, number, gid, found)
            except Exception:
                # A request that is not of the type of its key has nobody to tell.
                _LOG.exception("a request of %s failed", name)
                _drop(query)

        queryable = self._session.declare_queryable(
            key, lambda query: self._threads.submit(reply, query), complete=True
        )
        self._declarations.append(queryable)

    def add_publisher(
        self, name: str, type_: str, *, latched: bool = False
    ) -> Callable[[Any], None]:
        """Return what publishes messages on a topic, from any thread.

        Args:
            name: Name of the topic.
            type_: Name of its type.
            latched: Whether later subscribers get the last message.
        """
        key = self._declared("MP", name, type_, _LATCHED if latched else _VOLATILE)
        options: dict[str, Any] = {}
        if latched:
            options = {"cache": zenoh.ext.CacheConfig(1), "publisher_detection": True}
        publisher = zenoh.ext.declare_advanced_publisher(
            self._session, key, encoding=_ENCODING, **options
        )
        gid, numbers, lock = secrets.token_bytes(16), itertools.count(1), threading.Lock()

        def publish(message: Any) -> None:
            with lock:
                stamp = _ATTACHMENT.pack(next(numbers), time.time_ns(), 16, gid)
                publisher.put(self.types.encode(type_, message), attachment=stamp)

        return publish

    def add_subscriber(
        self, name: str, type_: str, receive: Callable[[Any], None], *, latched: bool = False
    ) -> None:
        """Receive the messages of a topic.

        Args:
            name: Name of the topic.
            type_: Name of its type.
            receive: Called with each message.
            latched: Whether messages that were published before are received too.
        """
        self._declared("MS", name, type_, _LATCHED if latched else _VOLATILE)

        def received(sample: zenoh.Sample) -> None:
            try:
                receive(self.types.decode(type_, sample.payload.to_bytes()))
            except Exception:
                _LOG.exception("a message of %s failed", name)

        options: dict[str, Any] = {}
        if latched:
            options["history"] = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        # With any hash: what tf publishes has been the same in every version of ROS 2.
        key = f"{self._domain}/{name.strip('/')}/{_dds(type_)}/*"
        subscriber = zenoh.ext.declare_advanced_subscriber(self._session, key, received, **options)
        self._declarations.append(subscriber)

    def _declared(self, kind: str, name: str, type_: str, quality: str) -> str:
        """Announce a service or topic, and return the key of its data."""
        hash_ = self.types.hash_of(type_)
        mangled = name.replace("/", "%")
        data = f"{mangled}/{_dds(type_)}/{hash_}"
        self._announce(f"0/{next(self._numbers)}/{kind}/%/%/{self._name}/{data}/{quality}")
        return f"{self._domain}/{name.strip('/')}/{_dds(type_)}/{hash_}"

    def _announce(self, rest: str) -> None:
        key = f"@ros2_lv/{self._domain}/{self._session.info.zid()}/{rest}"
        self._declarations.append(self._session.liveliness().declare_token(key))


def _drop(query: Any) -> None:
    """End a query: nothing more is replied."""
    query.drop()


def _dds(type_: str) -> str:
    """Return the name of a type in keys, e.g. "tcs_msgs::srv::dds_::Call_"."""
    package, part, name = type_.split("/")
    return f"{package}::{part}::dds_::{name}_"
