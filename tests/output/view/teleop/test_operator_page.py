"""The operator's page: Drake's page with camera pictures, served on this machine only."""

from __future__ import annotations

import re
import socket
from http.client import HTTPConnection

import pytest

from tcs.errors import OutputError
from tcs.output.view.teleop import operator_page
from tcs.output.view.teleop.operator_page import OperatorPage, operator_html


@pytest.fixture
def pictures():
    return {}


@pytest.fixture
def served(pictures):
    found = OperatorPage("<html>driving</html>", lambda: pictures)
    yield found
    found.close()


def got(page, path):
    """Return status, type and content of a path of a page."""
    connection = HTTPConnection("127.0.0.1", int(page.url.rsplit(":", 1)[1].strip("/")), timeout=5)
    try:
        connection.request("GET", path)
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


def test_an_occupied_port_is_refused():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(OutputError, match=f"port {port}"):
            OperatorPage("", dict, port)


def test_the_page_is_that_of_meshcat_and_loads_nothing_from_elsewhere(meshcat):
    page = operator_html(meshcat.port(), cameras=True, xr=True)
    here = f"http://localhost:{meshcat.port()}/"
    assert f'src="{here}' in page
    assert f'url = "{here}";' in page
    assert "showCameras" in page
    assert all(one.startswith(here) for one in re.findall(r'(?:src|href)="([^"]*)"', page))


def test_a_page_of_another_form_is_refused(meshcat, monkeypatch):
    monkeypatch.setattr(operator_page, "_page_of_meshcat", lambda port: "<html></html>")
    with pytest.raises(OutputError, match="cannot be extended"):
        operator_html(meshcat.port(), cameras=True, xr=True)
