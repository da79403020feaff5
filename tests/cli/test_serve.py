"""`tcs serve` and `tcs app`: what is refused before anything is served, and how they end."""

from __future__ import annotations

import pytest

from tcs.cli.serve import _say_ready

WITHOUT = "import sys; sys.modules['{}'] = None"


@pytest.mark.parametrize(
    ("words", "package", "extra"),
    [
        (("serve",), "fastapi", "service"),
        (("serve", "--mcp"), "mcp", "mcp"),
        (("serve", "--ros2"), "zenoh", "ros2"),
        (("app", "--no-browser"), "uvicorn", "app"),
    ],
    ids=["serve", "mcp", "ros2", "app"],
)
def test_without_the_extra_one_line_names_it(process, words, package, extra):
    ran = process(*words, before=WITHOUT.format(package))
    assert ran.code == 1
    assert f"needs the package {package}: pip install 'tcs[{extra}]'." in ran.err
    assert len(ran.err.splitlines()) == 1


def test_one_protocol_at_a_time(tcs_command):
    ran = tcs_command("serve", "--ros1", "--ros2")
    assert ran.code == 2
    assert "give one of them" in ran.err


@pytest.mark.parametrize("text", ["head", "=human/head", "head="])
def test_frames_of_the_person_have_a_form(tcs_command, text):
    ran = tcs_command("serve", "--ros1", "--person-frame", text)
    assert ran.code == 2
    assert "must be BODY=FRAME" in ran.err


def test_other_machines_require_a_token(tcs_command):
    ran = tcs_command("serve", "--host", "0.0.0.0", "--port", 0)
    assert ran.code == 1
    assert "can be reached from other machines" in ran.err


def test_a_file_that_is_no_score_file_is_one_line(tcs_command, tmp_path):
    path = tmp_path / "other.tcs"
    path.write_bytes(b"something else")
    ran = tcs_command("app", path, "--no-browser")
    assert ran.code == 1
    assert len(ran.err.splitlines()) == 1


def test_the_page_ends_after_its_duration(tcs_command, small_file):
    ran = tcs_command("app", small_file, "--no-browser", "--duration", 0.2)
    assert ran.code == 0
    assert "open http://127.0.0.1:" in ran.err


class Preparing:
    """Stands in for an engine: keeps what is to be called once it is prepared."""

    on_end = None

    def prepare(self, on_end):
        self.on_end = on_end


def test_a_service_is_ready_once_it_is_prepared(capsys):
    engine = Preparing()
    _say_ready(engine, "at http://127.0.0.1:1", prepare=True)
    assert capsys.readouterr().err == ""
    engine.on_end()
    assert capsys.readouterr().err == "tcs: at http://127.0.0.1:1\n"


def test_without_preparation_it_is_ready_at_once(capsys):
    engine = Preparing()
    _say_ready(engine, "at http://127.0.0.1:1", prepare=False)
    assert capsys.readouterr().err == "tcs: at http://127.0.0.1:1\n"
    assert engine.on_end is None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--mcp", "--port", 9000), "--port: is for HTTP, not for --mcp"),
        (("--ros1", "--token", "x" * 20), "--token: is for HTTP, not for --ros1"),
        (("--router", "tcp/localhost:1"), "--router: is for --ros2, not for HTTP"),
        (("--max-age", 2), "--max-age: is for --ros1 and --ros2, not for HTTP"),
        (("--mcp", "--no-prepare"), "--prepare: is for HTTP and --ros1 and --ros2, not for --mcp"),
    ],
    ids=["port", "token", "router", "frames", "prepare"],
)
def test_options_of_other_modes_are_refused(tcs_command, words, message):
    ran = tcs_command("serve", *words)
    assert ran.code == 2
    assert message in " ".join(ran.err.replace("│", " ").replace("'", "").split())
