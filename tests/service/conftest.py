"""Calls of processes made in this one, and a master of ROS 1 where Debian's packages are."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
import time

import pytest

from tcs.errors import ServiceError
from tcs.service import scene_processes
from tcs.service.ros.ros1_types import DEBIAN, ros1_modules
from tcs.service.worker import Worker


@pytest.fixture(scope="module")
def in_process():
    """Make the calls of processes in this one, where tests put something in place of the work."""
    current = threading.local()

    def call(_worker, function, *arguments, on_report=lambda _: None, look=lambda: None, **_):
        look()
        current.on_report = on_report
        return function(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Worker, "call", call)
        patch.setattr(scene_processes, "report", lambda value: current.on_report(value))
        yield


@pytest.fixture(scope="session")
def ros1_master(tmp_path_factory):
    """The address of a `rosmaster` of this process; its node is made once, as rospy demands."""
    try:
        ros1_modules()
    except ServiceError as error:
        pytest.skip(str(error))
    if not (DEBIAN / "rosmaster").is_dir():
        pytest.skip("no rosmaster; on Debian: apt-get install python3-rosmaster")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    logs = tmp_path_factory.mktemp("ros")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{port}")
        patch.setenv("ROS_HOSTNAME", "127.0.0.1")
        patch.setenv("ROS_HOME", str(logs))
        patch.setenv("ROS_LOG_DIR", str(logs))
        code = f"import sys; sys.path.append({str(DEBIAN)!r}); import rosmaster; "
        code += f"rosmaster.rosmaster_main(['--core', '-p', '{port}'])"
        master = subprocess.Popen([sys.executable, "-c", code], env=os.environ)
        try:
            _wait_for(port)
            yield os.environ["ROS_MASTER_URI"]
        finally:
            ros1_modules().rospy.signal_shutdown("the tests have ended")
            master.terminate()
            master.wait()


def _wait_for(port):
    end = time.monotonic() + 30.0
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except OSError:
            assert time.monotonic() < end, "the master did not start"
            time.sleep(0.1)
        else:
            return
