import dataclasses
import errno
import mmap
import os
import resource
import tracemalloc
import zlib

import joblib
import numpy as np
import pytest

from tcs.errors import OutputError, StoreError, StoreFormatError
from tcs.files import compression, mapped
from tcs.files.compression import compress, decoded_bytes, decompress
from tcs.placement.store import FORMAT_VERSION, ScoreFile, load_scores, save_scores
from tcs.placement.store.encoding import _PER_PAIR, encode
from tests.placement.store.example import SHIFT, score_file
from tests.placement.tables.small import small_grid


@pytest.fixture(scope="module")
def file():
    return score_file()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "shaving.tcs"


def assert_same(one, two):
    for field in dataclasses.fields(one):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if field.name == "tables":
            for of_one, of_two in zip(a, b, strict=True):
                assert_same(of_one.sets, of_two.sets)
                assert_same(of_one.scores, of_two.scores)
        elif dataclasses.is_dataclass(a):
            assert_same(a, b)
        elif isinstance(a, np.ndarray):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
        else:
            assert a == b


@pytest.mark.parametrize(
    "options",
    [{}, {"rule": "code2015", "same_environment": True}, {"max_members": 3}, {"max_members": 1}],
)
@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_load_of_save_is_the_same(path, share, options):
    file = score_file(share=share, options=options)
    save_scores(path, file)
    loaded = load_scores(path)
    assert isinstance(loaded, ScoreFile)
    assert_same(file, loaded)
    # No member of it can be changed by accident.
    with pytest.raises(ValueError, match="read-only"):
        loaded.nominal.scores.dexterity[0, 0] = 1.0


def test_joblib_reads_it_too(path, file):
    save_scores(path, file)
    content = joblib.load(path)
    assert content["format"] == "tcs scores"
    assert content["metadata"] == file.metadata


def test_a_compressed_file_is_read_too(path, file):
    joblib.dump(encode(file), path, compress=3)
    assert_same(file, load_scores(path))


def test_names_may_be_text_or_paths(path, file):
    save_scores(str(path), file)
    assert_same(load_scores(str(path)), load_scores(path))


def test_only_the_file_is_left(path, file):
    save_scores(path, file)
    save_scores(path, file)
    assert [found.name for found in path.parent.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("place", "raised"),
    [
        ("joblib.dump", KeyboardInterrupt()),
        ("os.fsync", KeyboardInterrupt()),
        ("os.fsync", OSError(errno.ENOSPC, "No space left on device")),
        ("pathlib.Path.replace", PermissionError(errno.EACCES, "Permission denied")),
        ("pathlib.Path.replace", KeyboardInterrupt()),
    ],
    ids=lambda value: getattr(value, "strerror", None) or str(value) or "Ctrl-C",
)
def test_a_failure_leaves_the_old_file_and_no_partial_one(path, file, monkeypatch, place, raised):
    path.write_bytes(b"the old file")

    def fail(*arguments, **options):
        # By now, half the file is written.
        if place == "joblib.dump":
            arguments[1].write(b"half")
        raise raised

    with monkeypatch.context() as patch:
        patch.setattr(place, fail)
        expected = OutputError if isinstance(raised, OSError) else KeyboardInterrupt
        with pytest.raises(expected) as caught:
            save_scores(path, file)
    if expected is OutputError:
        assert raised.strerror in str(caught.value)
        assert "\n" not in str(caught.value)
    assert path.read_bytes() == b"the old file"
    assert [found.name for found in path.parent.iterdir()] == [path.name]


def test_a_full_disk_is_refused(path, file):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
    try:
        with pytest.raises(OutputError, match="cannot be written: File too large"):
            save_scores(path, file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list(path.parent.iterdir()) == []


@pytest.mark.parametrize("folder", ["missing", "a file"])
def test_an_impossible_folder_is_refused(tmp_path, file, folder):
    (tmp_path / "a file").write_text("x")
    with pytest.raises(OutputError, match="existing, writable folder"):
        save_scores(tmp_path / folder / "shaving.tcs", file)


def test_a_folder_is_refused_as_target(tmp_path, file):
    with pytest.raises(OutputError, match="cannot be written"):
        save_scores(tmp_path, file)
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_folder_is_refused(path, file, monkeypatch):
    # Permissions do not stop root, who runs many a container; a refusal by the system does.
    def refuse(*_arguments, **_options):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    with pytest.raises(OutputError, match=r"cannot be written: Permission denied\. Name a file"):
        save_scores(path, file)
    assert list(path.parent.iterdir()) == []


def test_a_folder_or_pipe_is_refused_as_file(tmp_path):
    with pytest.raises(StoreError, match="not a regular file"):
        load_scores(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(StoreError, match="not a regular file"):
        load_scores(tmp_path / "pipe")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.9, 0.999])
def test_a_truncated_file_is_refused(path, file, share):
    save_scores(path, file)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(StoreFormatError, match=r"truncated|empty|damaged"):
        load_scores(path)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.999])
def test_a_truncated_uncompressed_file_is_refused(path, file, share):
    joblib.dump(encode(file), path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(StoreFormatError):
        load_scores(path)


def test_a_flipped_bit_is_refused(path, file):
    save_scores(path, file)
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 1
    path.write_bytes(whole)
    with pytest.raises(StoreFormatError):
        load_scores(path)


def test_flipped_bytes_never_crash(tmp_path, file):
    """Whatever value a byte has, the result is a valid file or a `TcsError`."""
    joblib.dump(encode(file), tmp_path / "whole")
    whole = (tmp_path / "whole").read_bytes()
    rng = np.random.default_rng(0)
    messages = []
    for _ in range(400):
        broken = bytearray(whole)
        for position in rng.integers(0, len(whole), 3):
            broken[position] = rng.integers(0, 256)
        (tmp_path / "broken").write_bytes(broken)
        try:
            load_scores(tmp_path / "broken")
        except StoreError as error:
            messages.append(str(error))
    assert len(messages) > 100
    assert not any("\n" in message for message in messages)


@pytest.mark.parametrize(
    "content",
    [b"Dear reader,\n", b"\x1f\x8b\x08\x00 gzip", b"PK\x03\x04", b"\x80", b"\x80\x04.", bytes(100)],
    ids=["text", "gzip", "zip", "one byte", "empty pickle", "zeros"],
)
def test_a_foreign_file_is_refused(path, content):
    path.write_bytes(content)
    with pytest.raises(StoreFormatError):
        load_scores(path)


@pytest.mark.parametrize("content", [[1, 2], {"a": np.zeros(3)}, None, {"format": "other"}, "x"])
@pytest.mark.parametrize("compress", [0, 3])
def test_another_joblib_file_is_refused(path, content, compress):
    joblib.dump(content, path, compress=compress)
    with pytest.raises(StoreFormatError, match="tcs"):
        load_scores(path)


def test_a_longer_file_is_refused(path, file):
    save_scores(path, file)
    path.write_bytes(path.read_bytes() + b"more")
    with pytest.raises(StoreFormatError, match="has data after its end"):
        load_scores(path)


def test_a_newer_file_is_refused(path, file):
    joblib.dump(encode(file) | {"format_version": FORMAT_VERSION + 1}, path)
    message = "written by a newer tcs, and this program reads version 4: update tcs"
    with pytest.raises(StoreFormatError, match=message):
        load_scores(path)


def test_an_older_file_is_refused_with_one_line_of_advice(path, file):
    joblib.dump(encode(file) | {"format_version": 2}, path)
    with pytest.raises(StoreFormatError) as refused:
        load_scores(path)
    assert str(refused.value) == (
        f"Score file '{path}': has format version 2, written by an older tcs, and this program "
        "reads version 4. Make it again with `tcs score`."
    )


def changed(file, section, name, change):
    content = encode(file)
    place = content
    if section in ("scores", "sets"):
        content["tables"] = [dict(content["tables"][0])]
        place = content["tables"][0]
    place[section] = dict(place[section])
    old = place[section][name]
    if isinstance(old, dict) and "bytes" in old:
        element = old["type"][0] if old["type"][0] == "u" else old["type"]
        array = decompress({name: old}, name, element, (None,) * len(old["shape"]))
        new = change(array)
        place[section][name] = compress(new) if isinstance(new, np.ndarray) else new
    else:
        place[section][name] = change(old)
    return content


FORGED = {
    "weights as float32": ("sets", "weights", lambda a: a.astype(np.float32)),
    "weights of another task": ("sets", "weights", lambda a: a[1:]),
    "candidates beyond the grid": ("sets", "candidate_step", lambda a: a + a.dtype.type(9)),
    "candidates that wrap round": (
        "sets",
        "candidate_step",
        lambda a: np.full(a.shape, 2**63, dtype=np.uint64),
    ),
    "a goal more reached": ("sets", "reached", lambda a: a | np.uint8(1)),
    "dexterity too short": ("sets", "dexterity", lambda a: a[:-1]),
    "dexterity of doubles": ("sets", "dexterity", lambda a: a.astype(np.float64)),
    "cell beyond the last": ("sets", "cell", lambda a: a + np.uint8(200)),
    "cell too short": ("sets", "cell", lambda a: a[1:]),
    "cells elsewhere": ("sets", "cell_xy", lambda a: a + 1.0),
    "cells nowhere": ("sets", "cell_xy", lambda a: a[:0]),
    "pairs of cells beyond": ("sets", "pair_step", lambda a: a + a.dtype.type(7)),
    "pairs that wrap round": (
        "sets",
        "pair_step",
        lambda a: np.full(a.shape, 2**63, dtype=np.uint64),
    ),
    "pairs out of order": ("sets", "pair_step", lambda a: a * a.dtype.type(0)),
    "count of pairs": ("sets", "pair_count", lambda a: a + a.dtype.type(100)),
    "bound not a number": ("sets", "pair_sum", lambda a: a * np.float32(np.nan)),
    "bound too short": ("sets", "pair_sum", lambda a: a[1:]),
    "code beyond the values": ("sets", "reachability_values", lambda a: a[:1]),
    "an invalid array": ("sets", "cell", lambda a: "cell"),
    "an array missing": ("sets", "pair_sum", lambda a: None),
    "rule unknown": ("sets", "rule", lambda rule: "mine"),
    "rule missing": ("sets", "rule", lambda rule: None),
    "distance missing": ("sets", "min_distance", lambda distance: None),
    "members missing": ("sets", "max_members", lambda members: True),
    "states of another grid": ("sets", "state_size", lambda size: size + 1),
    "environment no yes or no": ("sets", "same_environment", lambda same: 1),
    "lattice missing": ("sets", "lattice", lambda lattice: None),
    "lattice without a step": ("sets", "lattice", lambda lattice: lattice | {"step": [0.1]}),
    "lattice of another shape": ("sets", "lattice", lambda lattice: lattice | {"shape": [3, 3]}),
    "lattice without places": ("sets", "lattice", lambda lattice: lattice | {"shape": [0, 3]}),
    "enormous lattice": ("sets", "lattice", lambda lattice: lattice | {"shape": [2**40, 2**40]}),
    "triples where none belong": ("sets", "triples", lambda triples: {"least": 0.5}),
    "triples missing": ("sets", "max_members", lambda members: 3),
    "best no candidate": ("sets", "best", lambda best: [2**30]),
    "best no number": ("sets", "best", lambda best: ["x"]),
    "best huge": ("sets", "best_single", lambda best: [2**70]),
    "no axes": ("grid", "axes", lambda axes: []),
    "enormous grid": ("grid", "axes", lambda axes: [a | {"count": 10**6} for a in axes]),
    "another grid": (
        "grid",
        "axes",
        lambda axes: small_grid(nx=4, ny=6, bed=2).to_dict()["axes"],
    ),
    "no digest": ("metadata", "scene_digest", lambda digest: None),
    "array among the metadata": ("metadata", "created", lambda created: np.zeros(3)),
    "a body frame too short": ("body_frames", "head", lambda places: places[:-1]),
    "a body frame nowhere": ("body_frames", "head", lambda places: [np.inf] * len(places)),
}

FORGED_SCORES = {
    "reason with a row too few": ("scores", "reason", lambda a: a[1:]),
    "reason beyond the last": ("scores", "reason", lambda a: a + np.uint8(7)),
    "reason flat": ("scores", "reason", lambda a: a.ravel()),
    "reason missing": ("scores", "reason", lambda a: None),
    "reached by no candidate": ("scores", "reason", lambda a: a * np.uint8(0)),
    "joints of another arm": ("scores", "arm_joints", lambda a: a[:, :-1]),
    "joints missing": ("scores", "arm_joints", lambda a: a[:-1]),
    "joints not finite": ("scores", "arm_joints", lambda a: a * np.float32(np.inf)),
    "names missing": ("scores", "pair_names", lambda names: names[:1]),
    "names no pairs": ("scores", "pair_names", lambda names: [["arm"]] * 3),
    "names no list": ("scores", "pair_names", lambda names: "arm"),
}
"""Found on first access to the scores: selection never reads them."""


@pytest.mark.parametrize(
    ("section", "name", "change"),
    [*FORGED.values(), *FORGED_SCORES.values()],
    ids=[*FORGED, *FORGED_SCORES],
)
def test_a_forged_file_is_refused_in_one_line(path, file, section, name, change):
    joblib.dump(changed(file, section, name, change), path, compress=3)
    loaded = load_scores(path) if section == "scores" else None
    with pytest.raises(StoreFormatError) as caught:
        _ = loaded.nominal.scores if loaded else load_scores(path)
    message = str(caught.value)
    assert str(path) in message
    assert "tcs score" in message
    assert "while reading" not in message  # found by a check, not by stumbling
    assert "\n" not in message


def test_a_compressed_array_must_have_its_stated_size(path, file):
    """Data that decompress to more than their shape are refused before they fill the memory."""
    content = encode(file)
    bomb = np.frombuffer(zlib.compress(bytes(100_000_000)), dtype=np.uint8)
    content["tables"][0]["sets"]["pair_sum"]["bytes"] = bomb
    joblib.dump(content, path)
    with pytest.raises(StoreFormatError, match="damaged array 'pair_sum'"):
        load_scores(path)


@pytest.mark.parametrize("section", ["metadata", "task", "grid", "observed", "tables"])
def test_a_missing_section_is_refused(path, file, section):
    content = encode(file)
    del content[section]
    joblib.dump(content, path)
    with pytest.raises(StoreFormatError, match=f"has no {section}"):
        load_scores(path)


@pytest.mark.parametrize("section", ["scores", "sets"])
def test_a_missing_half_of_a_table_is_refused(path, file, section):
    content = encode(file)
    del content["tables"][0][section]
    joblib.dump(content, path)
    with pytest.raises(StoreFormatError, match=f"has no {section}"):
        load_scores(path)


def test_each_observed_state_has_a_table(path):
    file = score_file(observed=[SHIFT], tables=3)
    assert [state["person_y"] for state in file.observed_states] == [-0.05, 0.0, 0.05]
    assert file.nominal is file.tables[1]
    save_scores(path, file)
    assert_same(file, load_scores(path))
    with pytest.raises(StoreError, match="2 tables for 3 observed states"):
        score_file(observed=[SHIFT], tables=2)
    with pytest.raises(StoreError, match="more than 1000 states"):
        score_file(observed=[SHIFT | {"step": 1e-6, "count": 10**7}], tables=1)


def claim(content, name, shape, zeros):
    """Make an array of the sets claim a shape, with so many zeros compressed to a thousandth."""
    array = content["tables"][0]["sets"][name]
    array["shape"] = shape
    array["bytes"] = np.frombuffer(zlib.compress(bytes(zeros), 1), dtype=np.uint8)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("weights", [2**28]),
        ("weights", [1001]),
        ("candidate_step", [2**31]),
        ("cell_xy", [2**27, 2]),
    ],
)
def test_a_claim_beyond_what_the_file_holds_allocates_nothing(path, file, name, shape):
    """Before, 2 GiB of weights in a file of 2 MB took 4.1 GB and 21 s to refuse."""
    content = encode(file)
    claim(content, name, shape, 2 * 1024**2)
    joblib.dump(content, path)
    size = path.stat().st_size
    tracemalloc.start()
    try:
        with pytest.raises(StoreFormatError, match=r"claims arrays of|does not belong there"):
            load_scores(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # The file, its unpickled bytes, and what the sound parts decompress to.
    assert peak < 4 * size + 16 * 1024**2


def test_a_table_that_is_there_many_times_is_counted_as_often(path):
    """Each is decoded anew: before, 1,000 of them took the time and memory of as many."""
    content = encode(score_file(grid=small_grid(nx=8, ny=8, bed=2), observed=[SHIFT], tables=3))
    content["observed"] = [{**SHIFT, "step": 1e-4, "count": 1000}]
    content["tables"] = 1000 * content["tables"][:1]
    joblib.dump(content, path)
    assert path.stat().st_size < 1024**2
    with pytest.raises(StoreFormatError, match="claims arrays of"):
        load_scores(path)


GROUPS = {
    "pairs": ("pair_step", "pair_count", "reachability_code", "pair_manipulability", "pair_sum"),
    "triples": ("step", "count", "reachability", "manipulability", "total"),
}


@pytest.mark.parametrize("of", GROUPS)
def test_reading_takes_four_times_the_memory_of_the_arrays_at_most(path, of):
    """Small numbers are decoded to larger ones, and compared as larger ones still."""
    grid = small_grid(nx=24, ny=24, yaws=1, torsos=1)
    content = encode(score_file(grid=grid, options={"max_members": 3}))
    sets = content["tables"][0]["sets"]
    group = sets if of == "pairs" else sets["triples"]
    group |= {name: compress(np.ones(200_000, group[name]["type"])) for name in GROUPS[of]}
    joblib.dump(content, path)
    size = decoded_bytes(content, narrow=_PER_PAIR)
    tracemalloc.start()
    try:
        with pytest.raises(StoreFormatError, match=r"ascending|lexicographic|does not fit"):
            load_scores(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert size > 8_000_000
    assert peak < 4 * size


def test_a_table_beyond_the_memory_is_mapped_and_the_same(path, file, monkeypatch):
    save_scores(path, file)
    monkeypatch.setattr(mapped, "LEAST_BYTES", 1)
    monkeypatch.setattr(mapped, "CHUNK_BYTES", 100)
    monkeypatch.setattr(compression, "CHUNK_BYTES", 100)
    loaded = load_scores(path)
    assert_same(file, loaded)
    assert isinstance(base_of(loaded.nominal.scores.reason), mmap.mmap)
    assert loaded.nominal.scores.reason_counts() == file.nominal.scores.reason_counts()
    for values in ("reachability", "manipulability"):
        np.testing.assert_array_equal(
            getattr(loaded.nominal.scores, values)(), getattr(file.nominal.scores, values)()
        )
    save_scores(path, loaded)
    assert_same(file, load_scores(path))


def base_of(array):
    """What an array keeps its numbers in."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array.obj if isinstance(array, memoryview) else array


@pytest.mark.parametrize("tile", [1, "x", None, -0.1, float("nan")])
def test_a_tile_that_is_none_is_refused(path, file, tile):
    content = encode(file)
    content["tables"][0]["sets"]["tile"] = tile
    joblib.dump(content, path)
    with pytest.raises(StoreFormatError, match="tile"):
        load_scores(path)


def test_a_large_file_of_equal_reasons_is_no_bomb(path):
    """Nothing reached anywhere: a byte for each configuration and goal, compressed to nothing."""
    quiet = score_file(grid=small_grid(nx=60, ny=60, bed=2), share=0.0)
    save_scores(path, quiet)
    assert_same(quiet, load_scores(path))


@pytest.mark.parametrize("records", ["x", [], [None, None], {"a": 1}])
def test_records_of_robustness_that_do_not_fit_are_refused(path, file, records):
    content = encode(file)
    content["metadata"] = {**content["metadata"], "robustness": records}
    joblib.dump(content, path)
    with pytest.raises(StoreFormatError, match="'robustness' must be a list"):
        load_scores(path)
