"""The suite for files that `tcs` saves and loads: every format runs through all tests that apply.

A new format is one more entry of `FORMATS`.
"""

from __future__ import annotations

import errno
import os
import pickle
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest

from tcs.capability import load_map, save_map
from tcs.capability.arplace import (
    load_arplace,
    load_probability_map,
    query,
    save_arplace,
    save_probability_map,
)
from tcs.errors import DataFileError, OutputError, StoreError, TcsError
from tcs.files import reader
from tcs.placement.store import load_scores, save_scores
from tcs.teleop.runs.run_files import load_run, save_run
from tests.capability.arplace.example import discs
from tests.capability.arplace.example import model as arplace
from tests.capability.test_map import small_map
from tests.placement.store.example import score_file
from tests.teleop.runs.test_run_files import made as run


@dataclass(frozen=True)
class Format:
    """One type of file."""

    ending: str
    example: Callable[[], Any]
    save: Callable[[Path, Any], None]
    load: Callable[[Path], Any]
    error: type[TcsError]
    """Root of the errors that loading a bad file raises."""
    is_joblib: bool = True
    digits: float = 0.0
    """Relative and absolute error of numbers that are saved and loaded."""


def example_map():
    return small_map([[0, 0, 0, 0, 0], [1, 2, 3, 4, 1]], [0.5, 0.25], [1.0, 0.5])


def example_arplace():
    return arplace(discs(hole=0.15))


def example_probability_map():
    return query(example_arplace()).map


FORMATS = {
    "scores": Format(".tcs", score_file, save_scores, load_scores, StoreError),
    "map": Format(".tcm", example_map, save_map, load_map, StoreError),
    "ARPlace model": Format(".arp", example_arplace, save_arplace, load_arplace, StoreError),
    "probability map": Format(
        ".apm", example_probability_map, save_probability_map, load_probability_map, StoreError
    ),
    # CSV keeps ten digits.
    "run as CSV": Format(".csv", run, save_run, load_run, DataFileError, False, 1e-9),
}
JOBLIB = {name: file_format for name, file_format in FORMATS.items() if file_format.is_joblib}
over_formats = pytest.mark.parametrize("kept", FORMATS.values(), ids=FORMATS.keys())
over_joblib = pytest.mark.parametrize("kept", JOBLIB.values(), ids=JOBLIB.keys())


@pytest.fixture
def path(kept, tmp_path):
    """Path of a saved example."""
    path = tmp_path / f"example{kept.ending}"
    kept.save(path, kept.example())
    return path


def refused(kept, path):
    """Return the message with which loading a file is refused, and check that it is one line."""
    with pytest.raises(kept.error) as caught:
        kept.load(path)
    message = str(caught.value)
    assert "\n" not in message
    assert str(path) in message
    return message


def assert_same(one, other, digits):
    """Compare two values with all that their fields and containers hold."""
    if callable(one):
        # The scores of a table are read when they are used.
        one, other = one(), other()
    if isinstance(one, np.ndarray):
        assert (one.dtype.kind, one.shape) == (other.dtype.kind, other.shape)
        if one.dtype.kind == "f":
            np.testing.assert_allclose(one, other, rtol=digits, atol=digits)
        else:
            np.testing.assert_array_equal(one, other)
    elif isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key], digits)
    elif isinstance(one, list | tuple):
        assert len(one) == len(other)
        for mine, theirs in zip(one, other, strict=True):
            assert_same(mine, theirs, digits)
    elif hasattr(one, "__dataclass_fields__"):
        assert type(one) is type(other)
        for name in one.__dataclass_fields__:
            assert_same(getattr(one, name), getattr(other, name), digits)
    else:
        assert one == other


@over_formats
def test_what_is_loaded_is_what_was_saved(kept, path):
    assert_same(kept.load(path), kept.example(), kept.digits)


@over_formats
def test_saving_again_gives_the_same_content(kept, path, tmp_path):
    again = tmp_path / f"again{kept.ending}"
    kept.save(again, kept.load(path))
    if kept.is_joblib:
        # Bytes may differ: a pickle refers back to objects that are identical, not equal.
        assert_same(joblib.load(again), joblib.load(path), 0.0)
    else:
        assert again.read_bytes() == path.read_bytes()


@over_formats
@pytest.mark.parametrize("place", ["os.fsync", "pathlib.Path.replace"])
@pytest.mark.parametrize(
    "raised", [KeyboardInterrupt(), OSError(errno.ENOSPC, "No space left on device")], ids=repr
)
def test_a_failure_leaves_the_old_file(kept, path, monkeypatch, place, raised):
    before = path.read_bytes()

    def fail(*_arguments, **_options):
        raise raised

    with monkeypatch.context() as patch:
        patch.setattr(place, fail)
        expected = OutputError if isinstance(raised, OSError) else KeyboardInterrupt
        with pytest.raises(expected):
            kept.save(path, kept.example())
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


@over_formats
def test_a_folder_that_does_not_exist_is_one_line(kept, tmp_path):
    path = tmp_path / "gone" / f"example{kept.ending}"
    with pytest.raises(OutputError, match="cannot be written") as caught:
        kept.save(path, kept.example())
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@over_formats
def test_a_missing_file_is_one_line(kept, tmp_path):
    message = refused(kept, tmp_path / f"gone{kept.ending}")
    assert "cannot be read: No such file" in message


@over_formats
@pytest.mark.parametrize("fraction", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_file_is_refused(kept, path, fraction):
    whole = path.read_bytes()
    path.write_bytes(whole[: int(fraction * len(whole))])
    refused(kept, path)


@over_formats
@pytest.mark.parametrize(
    "content",
    [b"Dear reader,\n", b"\x1f\x8b\x08\x00 gzip", b"PK\x03\x04", b"\x80\x04.", bytes(100)],
    ids=["text", "gzip", "zip", "empty pickle", "zeros"],
)
def test_a_file_of_another_program_is_refused(kept, path, content):
    path.write_bytes(content)
    refused(kept, path)


@over_formats
def test_damaged_bytes_never_crash(kept, path):
    """A damaged file is loaded or refused in one line; it raises no other error."""
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    messages = []
    for _ in range(40):
        broken = bytearray(whole)
        for position in rng.integers(0, len(whole), 3):
            broken[position] = rng.integers(0, 256)
        path.write_bytes(broken)
        try:
            kept.load(path)
        except kept.error as error:
            messages.append(str(error))
    assert len(messages) > 10
    assert not any("\n" in message for message in messages)


@over_formats
def test_a_pickle_that_calls_a_function_is_refused(kept, path, tmp_path):
    class Call:
        def __reduce__(self):
            return os.system, (f"touch '{tmp_path / 'mark'}'",)

    for content in (pickle.dumps(Call()), zlib.compress(pickle.dumps({"metadata": Call()}))):
        path.write_bytes(content)
        refused(kept, path)
        assert not (tmp_path / "mark").exists()


@over_joblib
@pytest.mark.parametrize(("step", "words"), [(-1, "an older tcs"), (1, "a newer tcs")])
def test_another_version_is_refused_with_advice(kept, path, step, words):
    content = joblib.load(path)
    joblib.dump(content | {"format_version": content["format_version"] + step}, path)
    message = refused(kept, path)
    # There is no version before the first.
    is_none = content["format_version"] + step == 0
    assert ("has no format version" if is_none else words) in message
    assert "again with `tcs" in message


@over_joblib
def test_the_other_formats_are_refused(kept, path):
    for other in JOBLIB.values():
        if other is not kept:
            other.save(path, other.example())
            refused(kept, path)


@over_joblib
def test_an_entry_that_is_missing_or_of_another_type_is_refused(kept, path):
    content = joblib.load(path)
    for name in content:
        joblib.dump({key: value for key, value in content.items() if key != name}, path)
        refused(kept, path)
        joblib.dump(content | {name: 7.5 if isinstance(content[name], str) else "x"}, path)
        refused(kept, path)


@over_joblib
def test_lists_that_expand_to_a_billion_values_are_refused(kept, path):
    bomb = ["x"]
    for _ in range(30):
        bomb = [bomb, bomb]
    joblib.dump(joblib.load(path) | {"metadata": {"bomb": bomb}}, path)
    assert "levels or" in refused(kept, path)


@over_joblib
def test_bytes_that_decompress_to_too_much_are_refused(kept, path, monkeypatch):
    monkeypatch.setattr(reader, "MAX_BYTES", 1_000_000)
    path.write_bytes(zlib.compress(bytes(2_000_000)))
    assert "more than 1000000 bytes" in refused(kept, path)
