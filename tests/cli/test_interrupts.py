"""Progress messages of commands, and their state after an interrupt."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from pathlib import Path

import joblib
import pytest

from tests.chosen import some_of
from tests.fresh import fresh


def test_first_run_reports_that_it_compiles(tcs_command, example, tmp_path, monkeypatch):
    def score(*_arguments, on_compile, on_progress, **_options):
        on_compile()
        on_progress(1, 2)
        return example()

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    ran = tcs_command("score", "shaving", "--out", tmp_path / "o.tcs", "--json")
    # One line, no bar: stderr is no terminal here.
    assert (
        ran.err
        == "tcs: compiling for this machine, up to a minute; later runs use the compiled code.\n"
    )
    assert json.loads(ran.out)["goals"] == 5


SLOW_SCORE = """
import time
import tcs.placement.scoring.score_to_file as files
def score(*arguments, on_progress, **options):
    for done in range(200):
        on_progress(done, 200)
        time.sleep(0.05)
files.score = score
"""


def run_on_terminal(code: str, *words: str) -> str:
    """Return what a command draws on a pseudo-terminal."""
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.DEVNULL, stderr=theirs, stdin=theirs
    ) as running:
        os.close(theirs)
        seen, sent = b"", False
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:
                break
            seen += part
            if b"/200" in seen and not sent:
                # Once: a second Ctrl-C may come while the line about the first is written.
                running.send_signal(signal.SIGINT)
                sent = True
            if not part:
                break
    os.close(ours)
    return seen.decode()


def test_bar_on_a_terminal(tmp_path):
    code = f"import sys\n{SLOW_SCORE}\nfrom tcs.cli import main\nmain()"
    seen = run_on_terminal(code, "score", "shaving", "--out", str(tmp_path / "o.tcs"))
    assert "configurations" in seen
    assert "/200" in seen
    assert "interrupted; no half-written file is left." in seen
    assert list(tmp_path.iterdir()) == []


ENDINGS = [
    (signal.SIGINT, 130, "tcs: interrupted; no half-written file is left.\n"),
    (signal.SIGTERM, 143, "tcs: terminated; no half-written file is left.\n"),
    (signal.SIGHUP, 129, "tcs: hung up; no half-written file is left.\n"),
]


def signals(*quick: int):
    """Give a test every signal; all but some are slow, as one handler takes them all."""
    chosen = [ending for ending in ENDINGS if ending[0] in quick]
    return pytest.mark.parametrize(
        ("number", "code", "line"),
        some_of(ENDINGS, *chosen),
        ids=["ctrl-c", "terminated", "hung-up"],
    )


@signals(signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
def test_interrupt_while_scoring(tmp_path, number, code, line):
    script = f"import sys\n{SLOW_SCORE.replace('time.sleep', 'print(0, flush=True); time.sleep')}\n"
    script += "from tcs.cli import main\nmain()"
    with subprocess.Popen(
        [sys.executable, "-c", script, "score", "shaving", "--out", str(tmp_path / "o.tcs")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stdout.readline() == "0\n"
        running.send_signal(number)
        _, message = running.communicate()
    assert running.returncode == code
    assert message == line
    assert list(tmp_path.iterdir()) == []


@signals(signal.SIGINT)
@pytest.mark.parametrize("module", ["tcs.cli.app", "typer", "tcs.cli.view", "numpy"])
def test_interrupt_while_modules_are_imported(process, module, number, code, line):
    before = f"""
import signal
class Interrupting:
    def find_spec(self, name, *_):
        if name == "{module}":
            signal.raise_signal({int(number)})
sys.meta_path.insert(0, Interrupting())
"""
    ran = process("list", before=before)
    assert (ran.code, ran.out, ran.err) == (code, "", line)


@signals(signal.SIGTERM)
def test_interrupt_that_an_import_replaces_by_another_error(process, number, code, line):
    # As compiled modules do: their import ends in an ImportError.
    before = f"""
import signal
class Interrupting:
    def find_spec(self, name, *_):
        if name == "tcs.cli.view":
            try:
                signal.raise_signal({int(number)})
            except KeyboardInterrupt:
                raise ImportError("initialization failed") from None
sys.meta_path.insert(0, Interrupting())
"""
    ran = process("list", before=before)
    assert (ran.code, ran.out, ran.err) == (code, "", line)


@signals(signal.SIGHUP)
def test_interrupt_while_the_command_line_is_parsed(process, number, code, line):
    before = f"""
import signal
import typer.core
def parse_args(self, ctx, args):
    signal.raise_signal({int(number)})
typer.core.TyperGroup.parse_args = parse_args
"""
    ran = process("list", before=before)
    assert (ran.code, ran.out, ran.err) == (code, "", line)


@signals(signal.SIGINT)
def test_interrupt_while_a_compiled_module_is_loaded_waits_for_its_end(process, number, code, line):
    # Drake logs an exception raised there, with its traceback.
    before = f"""
import signal, sys, time
text = "def create_module():\\n    signal.raise_signal({int(number)})\\n    print('loaded')"
exec(compile(text, "<frozen importlib._bootstrap_external>", "exec"))
class Loading:
    def find_spec(self, name, *_):
        if name == "tcs.cli.view":
            create_module()
            # Only between two steps of Python does the main thread see the signal.
            for _ in range(500):
                time.sleep(0.01)
sys.meta_path.insert(0, Loading())
"""
    ran = process("list", before=before)
    assert (ran.code, ran.out, ran.err) == (code, "loaded\n", line)


@signals(signal.SIGTERM)
def test_interrupt_of_python_code_run_by_compiled_code_ends_with_the_exit_code(
    tmp_path, number, code, line
):
    # Python notes an unhandled interrupt there, whatever happens further out, and `python -m` then
    # ends with the signal. The site module is the only place for code before that of `-m`.
    (tmp_path / "sitecustomize.py").write_text(f"""
import ctypes, sys
class Running:
    def find_spec(self, name, *_):
        if name == "tcs.cli.view":
            run = ctypes.pythonapi.PyRun_String
            names = 2 * [ctypes.py_object]
            run.restype, run.argtypes = ctypes.py_object, [ctypes.c_char_p, ctypes.c_int, *names]
            run(b"import signal; signal.raise_signal({int(number)})", 257, {{}}, {{}})
sys.meta_path.insert(0, Running())
""")
    checkout = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-m", "tcs", "list"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{checkout}"},
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, "", line)


def test_interrupt_after_the_end_prints_no_traceback(process):
    before = """
import atexit, signal
atexit.register(lambda: signal.raise_signal(signal.SIGINT))
"""
    ran = process("--version", before=before)
    assert (ran.code, ran.err) == (-signal.SIGINT, "")


def test_the_command_can_be_interrupted_before_anything_large_is_imported():
    loaded = fresh("import sys, tcs.cli; print('typer' in sys.modules, 'numpy' in sys.modules)")
    assert loaded == "False False"


def test_a_handler_of_the_calling_program_stays(tcs_command):
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert tcs_command("--version").code == 0
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGTERM, before)


def test_interrupt_in_a_callback_of_compiled_code_is_one_line(process, tmp_path):
    """Python prints such an interrupt and continues, as callbacks of llvmlite cannot raise."""
    before = """
import ctypes, signal
import tcs.placement.scoring.score_to_file as files
callback = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
def score(*arguments, on_progress, **options):
    callback()
    on_progress(1, 2)
files.score = score
"""
    ran = process("score", "shaving", "--out", tmp_path / "o.tcs", before=before)
    assert ran.code == 130
    assert ran.err == "tcs: interrupted; no half-written file is left.\n"


def test_an_interrupt_dropped_by_compiled_code_takes_effect(tcs_command, tmp_path, monkeypatch):
    def score(*_arguments, on_progress, **_options):
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        on_progress(1, 2)
        raise AssertionError("must not get here")

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    ran = tcs_command("score", "shaving", "--out", tmp_path / "o.tcs")
    assert ran.code == 130
    assert "interrupted" in ran.err


def test_interrupt_while_writing_keeps_the_old_file(tcs_command, small_file, stand_in, monkeypatch):
    before = small_file.read_bytes()

    def dump(_content, stream, **_options):
        stream.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(joblib, "dump", dump)
    ran = tcs_command("score", "shaving", "--out", small_file)
    assert ran.code == 130
    assert small_file.read_bytes() == before
    assert list(small_file.parent.iterdir()) == [small_file]


@pytest.mark.parametrize(
    "error", [MemoryError("std::bad_alloc"), RuntimeError("can't start new thread")]
)
def test_too_little_memory_is_told_in_one_line(error, tcs_command, tmp_path, monkeypatch):
    def score(*_arguments, **_options):
        raise error

    monkeypatch.setattr("tcs.placement.scoring.score_to_file.score", score)
    ran = tcs_command("score", "shaving", "--out", tmp_path / "o.tcs")
    assert ran.code == 1
    assert ran.err.startswith("tcs: the memory does not suffice.")
    assert ran.err.count("\n") == 1
