"""Pages of base poses: local server only, log level restored, content of the page."""

import logging
import os
from pathlib import Path

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.output.view import base_poses
from tcs.output.view.base_poses import write_page

POSES = np.array([[0.0, -0.5, 1.5, 0.2], [0.1, -0.6, 1.2, 0.9]])


def listening_addresses():
    """Return the local addresses on which this process listens, as hexadecimal digits."""
    links = [os.readlink(f"/proc/self/fd/{fd}") for fd in os.listdir("/proc/self/fd")
             if Path(f"/proc/self/fd/{fd}").is_symlink()]  # fmt: skip
    sockets = {link[8:-1] for link in links if link.startswith("socket:[")}
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        if not Path(table).exists():
            continue
        for line in Path(table).read_text().splitlines()[1:]:
            fields = line.split()
            # State 0A is LISTEN.
            if fields[3] == "0A" and fields[9] in sockets:
                found.add(fields[1].split(":")[0])
    return found


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="needs /proc of Linux")
def test_the_page_is_served_to_this_machine_only(tmp_path, monkeypatch):
    seen = set()
    write = base_poses.whole_file

    def spy(path, what):
        seen.update(listening_addresses())
        return write(path, what)

    monkeypatch.setattr(base_poses, "whole_file", spy)
    write_page(tmp_path / "page.html", POSES, length=0.02, tools=[])
    local = {"0100007F", "0" * 24 + "01000000"}
    assert seen & local
    # Other viewers of this test run are local as well.
    assert seen <= local
    assert (tmp_path / "page.html").stat().st_size > 10_000


def test_the_log_level_is_restored_if_no_port_is_free(tmp_path, monkeypatch):
    def fail(*_arguments, **_options):
        raise RuntimeError("Meshcat failed to open a websocket port.")

    for module in ("tcs.output.view.live", "tcs.output.view.base_poses"):
        monkeypatch.setattr(f"{module}.Meshcat", fail)
    log = logging.getLogger("drake")
    monkeypatch.setattr(log, "level", log.level)
    log.setLevel(logging.INFO)
    with pytest.raises(OutputError, match="cannot listen"):
        write_page(tmp_path / "page.html", POSES, length=0.02, tools=[])
    assert log.level == logging.INFO
    assert not (tmp_path / "page.html").exists()
