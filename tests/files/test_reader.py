"""Files that try to execute code when they are read; none may succeed, which would leave a mark."""

import os
import pickle
import struct
import tracemalloc
import zlib

import joblib
import numpy as np
import pytest

from tcs.errors import StoreFormatError, UnsafeStoreError
from tcs.files import reader
from tcs.placement.store import load_scores
from tcs.placement.store.encoding import encode
from tests.placement.store.example import score_file


class Call:
    """Pickles as a call of any function."""

    def __init__(self, function, *arguments, state=None):
        self.parts = (function, arguments) if state is None else (function, arguments, state)

    def __reduce__(self):
        return self.parts


@pytest.fixture
def mark(tmp_path):
    """A file that appears when one of the attacks succeeds."""
    return tmp_path / "mark"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "attack.tcs"


def attacks(mark):
    touch = f"touch '{mark}'"
    code = f"open({str(mark)!r}, 'w').close()"
    objects = np.array([Call(os.system, touch), None], dtype=object)
    structured = np.zeros(1, dtype=[("x", object)])
    structured["x"][0] = Call(os.system, touch)
    return {
        "os.system": Call(os.system, touch),
        "eval": Call(eval, f"__import__('os').system({touch!r})"),
        "exec": Call(exec, code),
        "in a list": [1, [2, Call(os.system, touch)]],
        "as a dict value": {"format": "tcs scores", "format_version": Call(os.system, touch)},
        "as a dict key": {"metadata": {("a", Call(os.system, touch)): 1}},
        "getattr": Call(getattr, Call(__import__, "os"), "system"),
        "numpy.load": Call(np.load, str(mark), None, True),
        "numpy scalar": np.float64(1.0),
        "array of objects": objects,
        "array of objects in a dict": {"scores": {"dexterity": objects}},
        "structured array of objects": structured,
        "joblib.load": Call(joblib.load, str(mark)),
        "a class of ours": Call(type(reader._Known.ARRAY), ("numpy", "ndarray")),
        "set state of a class": Call(np.dtype, "f4", state={"x": Call(os.system, touch)}),
        "memory map": Call(np.memmap, str(mark), "u1", "w+", 0, (4,)),
    }


NAMES = list(attacks(""))


@pytest.mark.parametrize("compress", [0, 3], ids=["plain", "zlib"])
@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_executed(path, mark, name, compress):
    joblib.dump(attacks(mark)[name], path, compress=compress)
    with pytest.raises(UnsafeStoreError) as caught:
        load_scores(path)
    assert "\n" not in str(caught.value)
    assert not mark.exists()


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("name", ["os.system", "in a list", "as a dict key"])
def test_nothing_is_executed_in_any_protocol(path, mark, name, protocol):
    path.write_bytes(zlib.compress(pickle.dumps(attacks(mark)[name], protocol=protocol)))
    with pytest.raises((UnsafeStoreError, StoreFormatError)):
        load_scores(path)
    assert not mark.exists()


def test_the_attacks_are_real(path, mark):
    """joblib's own reader executes them, so the tests above can fail."""
    for name in ("os.system", "in a list", "array of objects"):
        joblib.dump(attacks(mark)[name], path)
        joblib.load(path)
        assert mark.exists()
        mark.unlink()


def test_the_message_contains_the_name(path, mark):
    joblib.dump(attacks(mark)["os.system"], path)
    with pytest.raises(UnsafeStoreError, match=r"attack\.tcs' refers to '(posix|nt)\.system'"):
        load_scores(path)


def test_a_sound_file_with_an_attack_inside(path, mark):
    content = encode(score_file())
    content["environment"] = content["environment"] | {"wall": Call(os.system, f"touch {mark}")}
    joblib.dump(content, path, compress=3)
    with pytest.raises(UnsafeStoreError):
        load_scores(path)
    assert not mark.exists()


def stream(*parts):
    """A hand-written pickle."""
    return b"\x80\x04" + b"".join(parts) + b"."


def text(value):
    return b"\x8c" + bytes([len(value)]) + value.encode()


WRAPPER = text("joblib.numpy_pickle") + text("NumpyArrayWrapper") + b"\x93"
NDARRAY = text("numpy") + text("ndarray") + b"\x93"
DTYPE = text("numpy") + text("dtype") + b"\x93"
FLOAT = (
    DTYPE
    + text("f4")
    + b"\x89\x88\x87R(K\x03"
    + text("<")
    + b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb"
)


def array(shape, dtype=FLOAT, order="C", subclass=NDARRAY, data=b""):
    """An array as joblib writes it, with any description."""
    state = b"}(" + text("subclass") + subclass + text("shape") + shape
    state += text("order") + text(order) + text("dtype") + dtype
    return stream(WRAPPER, b")\x81", state, b"ub", data)


HOSTILE = {
    "calls the wrapper": stream(WRAPPER, b")R"),
    "calls ndarray": stream(NDARRAY, b"(J\xff\xff\xff\x7ftR"),
    "makes an ndarray": stream(NDARRAY, b"(J\xff\xff\xff\x7ft\x81"),
    "makes a wrapper with arguments": stream(WRAPPER, b"K\x01\x85\x81"),
    "makes by keywords": stream(WRAPPER, b")}\x92"),
    "sets attributes of a name": stream(WRAPPER, b"}" + text("read") + b"K\x01sb"),
    "sets slots of a name": stream(WRAPPER, b"N}" + text("read") + b"K\x01s\x86b"),
    "sets attributes of a dict": stream(b"}}b"),
    "calls an array": stream(WRAPPER, b")\x81", b")R"),
    "calls text": stream(text("os.system"), text("ls"), b"\x85R"),
    "extension": stream(b"\x82\x01"),
    "persistent": stream(text("id"), b"Q"),
    "object opcode": stream(b"(", DTYPE, text("O"), b"o"),
    "element type of objects": stream(DTYPE, text("O"), b"\x85R"),
    "element type of fields": stream(DTYPE, text("f4,O"), b"\x85R"),
    "element type of a huge void": stream(DTYPE, text("V2000000000"), b"\x85R"),
    "submodule": stream(text("numpy"), text("dtype.__init__"), b"\x93"),
    "global in protocol 0": b"\x80\x02cos\nsystem\n(S'ls'\ntR.",
    "inst in protocol 0": b"\x80\x02(X\x02\x00\x00\x00lsios\nsystem\n.",
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_hand_written_attack_is_refused(path, content):
    path.write_bytes(zlib.compress(content))
    with pytest.raises(UnsafeStoreError) as caught:
        load_scores(path)
    assert len(str(caught.value)) < 500


BROKEN = {
    "array larger than the file": array(b"J\xff\xff\xff\x7f\x85"),
    "product overflows": array(b"J\xff\xff\xff\x7f" * 3 + b"\x87"),
    "negative shape": array(b"J\xff\xff\xff\xff\x85"),
    "shape of floats": array(b"G" + struct.pack(">d", 2.0) + b"\x85"),
    "shape of booleans": array(b"\x88\x85"),
    "shape without end": array(b"(" + b"K\x01" * 100 + b"t"),
    "huge shape of nothing": array(b"K\x00\x8a\x09" + b"\xff" * 8 + b"\x00\x86"),
    "no tuple": array(b"K\x02"),
    "unknown order": array(b"K\x00\x85", order="A"),
    "unknown class": array(b"K\x00\x85", subclass=DTYPE),
    "unknown element": array(b"K\x00\x85", dtype=text("f4")),
    "state without dict": stream(WRAPPER, b")\x81", b"K\x01b"),
    "byte order": stream(DTYPE, text("f4"), b"\x85R(K\x03", text("x"), b"tb"),
    "element type as a value": stream(DTYPE, text("f4"), b"\x85R"),
    "name as a value": stream(DTYPE),
    "huge text": stream(b"X\xff\xff\xff\x7f", b"abc"),
    "huge frame": stream(b"\x95" + b"\xff" * 7 + b"\x7f"),
    "bytearray of 2**62": stream(b"\x96" + struct.pack("<Q", 2**62)),
    "unhashable key": stream(b"}]K\x01s"),
    "stack underflow": stream(b"0b"),
    "no mark": stream(b"t"),
    "memo": stream(b"h\x07"),
    "after the end": stream(b"N") + b"N",
    "self-containing": stream(b"}\x94" + text("format") + b"h\x00s"),
    "deep": stream(b"]" + b"\x85" * 100_000),
}


@pytest.mark.parametrize("content", BROKEN.values(), ids=BROKEN.keys())
def test_a_hand_written_damaged_file_is_refused(path, content):
    path.write_bytes(zlib.compress(content))
    with pytest.raises(StoreFormatError) as caught:
        load_scores(path)
    assert len(str(caught.value)) < 500


def test_a_bomb_is_refused(path, monkeypatch):
    monkeypatch.setattr(reader, "MAX_BYTES", 10**6)
    path.write_bytes(zlib.compress(bytes(10**7)))
    with pytest.raises(StoreFormatError, match="decompresses to more than 1000000 bytes"):
        load_scores(path)


def test_terminal_codes_in_a_name_are_not_passed_on(path):
    path.write_bytes(zlib.compress(stream(text("\x1b[2Jos\n"), text("system"), b"\x93")))
    with pytest.raises(UnsafeStoreError) as caught:
        load_scores(path)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4", "u8", "i4", "i8", "f4", "f8", ">f4", ">u2"])
@pytest.mark.parametrize("shape", [(0,), (5,), (3, 4), (2, 3, 4), (0, 7), ()])
@pytest.mark.parametrize("compress", [0, 1])
def test_arrays_are_read_as_joblib_wrote_them(path, dtype, shape, compress):
    values = np.random.default_rng(0).integers(0, 200, shape).astype(dtype)
    wanted = {"C": values, "F": np.array(values, order="F"), "n": 3}
    joblib.dump(wanted, path, compress=compress)
    got = reader.read_joblib(path)
    assert got["n"] == 3
    for order in "CF":
        np.testing.assert_array_equal(got[order], values)
        assert got[order].dtype.isnative
        assert got[order].shape == shape


def test_keys_that_are_not_text_are_refused(path):
    # Whole numbers that are multiples of this one have the same hash: a dict of them takes forever.
    same = (1 << 61) - 1
    for content in ({0: None}, {i * same: None for i in range(3)}, {"a": {1.5: None}}):
        path.write_bytes(pickle.dumps(content))
        with pytest.raises(StoreFormatError, match="keys must be text"):
            load_scores(path)


@pytest.mark.parametrize("operations", [b"}", b"]\x94"], ids=["dicts", "memo"])
def test_objects_take_at_most_twice_the_memory_of_the_bytes(path, operations, monkeypatch):
    monkeypatch.setattr(reader, "FREE_OPERATIONS", 1000)
    path.write_bytes(b"\x80\x04" + operations * 1_000_000 + b".")
    tracemalloc.start()
    with pytest.raises(StoreFormatError, match="far more values than a file of tcs"):
        load_scores(path)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # The bytes themselves are read with a copy.
    assert most < 4 * path.stat().st_size + 1e6


def test_a_wrapped_file_decompresses_to_some_times_its_size(path, monkeypatch):
    monkeypatch.setattr(reader, "FREE_BYTES", 1000)
    path.write_bytes(zlib.compress(os.urandom(20_000) + bytes(1_000_000)))
    with pytest.raises(StoreFormatError, match="decompresses to more than"):
        load_scores(path)
