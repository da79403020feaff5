"""The operator's page: Drake's page with camera pictures, served on this machine only."""

from __future__ import annotations

import json
import re
import socket
import sys
import urllib.request
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

from tcs.errors import OutputError
from tcs.output.view import open_meshcat
from tcs.output.view.scene_page import ScenePage
from tcs.output.view.teleop import operator_page
from tcs.output.view.teleop.controls import buttons, sliders
from tcs.output.view.teleop.operator_page import OperatorPage, desk_of, operator_html
from tcs.output.view.teleop.page_link import PageLink
from tcs.teleop import Settings


@pytest.fixture
def pictures():
    return {}


@pytest.fixture
def served(pictures, link, meshcat):
    found = OperatorPage("<html>driving</html>", lambda: pictures, link, meshcat)
    yield found
    found.close()


def got(page, path, verb="GET", content=None, **headers):
    """Return status, type and content of a path of a page."""
    connection = HTTPConnection("127.0.0.1", int(page.url.rsplit(":", 1)[1].strip("/")), timeout=5)
    try:
        connection.request(verb, path, content, headers)
        reply = connection.getresponse()
        return reply.status, reply.headers["Content-Type"], reply.read()
    finally:
        connection.close()


def test_the_page_and_its_pictures_are_served(served, pictures):
    assert got(served, "/") == (200, "text/html; charset=utf-8", b"<html>driving</html>")
    assert got(served, "/cameras")[2] == b"[]"
    pictures.update({"wrist camera": b"wrist", "head camera": b"head"})
    assert got(served, "/cameras")[2] == b'["head camera", "wrist camera"]'
    assert got(served, "/camera/0?12.5") == (200, "image/jpeg", b"head")
    assert got(served, "/camera/1")[2] == b"wrist"


@pytest.mark.parametrize("path", ["/camera/2", "/camera/", "/camera/-1", "/camera/head", "/other"])
def test_nothing_else_is_served(served, pictures, path):
    pictures.update({"wrist camera": b"wrist", "head camera": b"head"})
    assert got(served, path)[0] == 404


def test_an_occupied_port_is_refused(meshcat):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(OutputError, match=f"port {port}"):
            OperatorPage("", dict, PageLink({}, {}), meshcat, port)


def test_keys_arrive_and_the_readout_returns(served, link):
    message = {"page": "a", "number": 1, "held": ["KeyW"], "clicks": {"KeyM": 1}}
    status, _, content = got(served, "/link", "POST", json.dumps(message))
    assert status == 200
    assert json.loads(content)["mode"] == ""
    assert link.read().held == {"ahead"}
    assert link.read().clicks["next mode"] == 1


@pytest.mark.parametrize(
    "content", ["", "[", "[" * 4000, "null", "{}", '{"page": 1}', " " * 5000 + "{}", '"\u00e9"']
)
def test_other_messages_are_refused(served, link, content):
    assert got(served, "/link", "POST", content)[0] == 400
    assert link.read().held == set()


def test_pages_of_other_servers_cannot_drive(served, link):
    message = json.dumps({"page": "a", "number": 1, "held": ["KeyW"], "clicks": {}})
    host = served.url.removeprefix("http://").strip("/")
    assert got(served, "/link", "POST", message, Origin="http://evil.example")[0] == 403
    assert got(served, "/link", "POST", message, Host="evil.example:7100")[0] == 403
    assert got(served, "/", Host="evil.example")[0] == 403
    assert got(served, "/link", "POST", message, Host="localhost:1")[0] == 403
    for site in ("cross-site", "same-site"):
        # A picture or a frame in a page of elsewhere has no origin.
        assert got(served, "/camera/0", **{"Sec-Fetch-Site": site})[0] == 403
        assert got(served, "/link", "POST", message, **{"Sec-Fetch-Site": site})[0] == 403
    assert link.read().held == set()
    assert got(served, "/link", "POST", message, Host=host, Origin=f"http://{host}")[0] == 200
    assert link.read().held == {"ahead"}


def test_the_page_names_every_key_and_joint(iiwa):
    groups = Settings().groups
    desk = desk_of(iiwa, groups, sliders())
    assert {key["code"] for key in desk["keys"]} == set(buttons(len(groups)).values())
    assert {key["code"] for key in desk["keys"] if not key["hold"]} == {
        *("KeyM", "KeyC", "Space", "KeyX"), *(f"Digit{i + 1}" for i in range(len(groups))),
    }  # fmt: skip
    assert [joint["low"] for joint in desk["joints"]] == [-170, -120, -170, -120, -170, -120, -175]
    assert all(joint["bounded"] for joint in desk["joints"])


def test_the_page_is_that_of_meshcat_and_loads_nothing_from_elsewhere(served):
    desk = {"title": "A <robot>", "keys": [{"name": "</script>"}]}
    page = operator_html(desk, cameras=True, xr=True)
    assert "showCameras" in page
    assert "<title>A &lt;robot&gt;</title>" in page
    assert page.count("</script>") == page.count("<script")
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["meshcat.js"]
    assert got(served, "/meshcat.js")[0] == 200


def test_a_page_of_another_form_is_refused(monkeypatch):
    monkeypatch.setattr(operator_page, "part_of_meshcat", lambda name: b"<html></html>")
    with pytest.raises(OutputError, match="cannot be extended"):
        operator_html({}, cameras=True, xr=True)


def opened(page, origin, host=None):
    """Open the page's socket to the scene as a browser does; return it, and what it says first."""
    at = page.url.removeprefix("http://").strip("/")
    found = socket.create_connection(("127.0.0.1", int(at.rpartition(":")[2])), timeout=10)
    found.sendall(
        f"GET / HTTP/1.1\r\nHost: {host or at}\r\nOrigin: {origin}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return found, found.recv(65536)


def test_the_scene_is_open_to_its_own_page_only(served, meshcat):
    own = served.url.strip("/")
    foreign = ("http://evil.example", "null", f"http://localhost:{meshcat.port()}")
    for origin, host in (*((one, None) for one in foreign), (own, "evil.example")):
        socket_, reply = opened(served, origin, host)
        with socket_:
            assert reply.startswith(b"HTTP/1.1 403 ")
    assert meshcat.GetNumActiveConnections() == 0
    socket_, reply = opened(served, own)
    with socket_:
        assert reply.startswith(b"HTTP/1.1 101 ")
        assert meshcat.GetNumActiveConnections() == 1


def test_a_viewer_is_open_to_its_own_page_only(meshcat):
    viewer = ScenePage(meshcat)
    try:
        assert got(viewer, "/", **{"Sec-Fetch-Site": "cross-site"})[0] == 403
        assert b"Drake MeshCat" in got(viewer, "/")[2]
        for origin, status in (("http://evil.example", b"403"), (viewer.url.strip("/"), b"101")):
            socket_, reply = opened(viewer, origin)
            with socket_:
                assert reply.startswith(b"HTTP/1.1 " + status)
    finally:
        viewer.close()


def test_a_hidden_meshcat_is_not_where_a_page_would_look():
    first, second = (urlsplit(open_meshcat(hidden=True).web_url()) for _ in range(2))
    assert first.port not in range(7000, 8000)
    if sys.platform == "linux":
        assert first.hostname != second.hostname
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", first.port), timeout=5)


def test_the_page_can_be_in_no_frame(served):
    with urllib.request.urlopen(served.url) as reply:
        policy = reply.headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; ")
    assert "frame-ancestors 'none'" in policy
    host = served.url.removeprefix("http://").strip("/")
    assert f"connect-src 'self' ws://{host} data: blob:;" in policy
    assert "eval" not in policy
