"""Structure-aware mutations of the files a user can hand to `tcs`.

As in AFL++ and in libFuzzer's custom mutators, a file is parsed, one to three nodes of its tree are
changed, and it is written again, so that most mutants pass the parser and reach the checks behind
it; one mutant in five is damaged byte by byte instead, which tests the parser itself.
"""

from __future__ import annotations

import io
import json
import pickle
import xml.etree.ElementTree as ElementTree
import zlib
from collections.abc import Callable
from functools import cache
from typing import Any

import joblib
import numpy as np
import yaml

NUMBERS: tuple[Any, ...] = (
    *(0, -0.0, 1, -1, 1e-9, 1e-6, 1e-300, 5e-324, 0.5, 2.0, 3.0, 10.0, 39.0, 41.0, 99.0, 101.0),
    *(1e3, 1e6, 1e9, 1e15, -1e15, 1e16, 1e100, 1e308, -1e308, 2**31, 2**63, 10**30),
    *(float("nan"), float("inf"), float("-inf"), 720.0, 1e4, 360, 180, 0.001, 1000, 20_000_001),
)
TEXTS = (
    *("", "nan", "inf", "-inf", "1e400", "world", "base", "floor", "static", "head", "0x10", "1e"),
    *(
        "a\0b",
        "é\u2028",
        "../../../../etc/passwd",
        "/dev/zero",
        "~unknown-user/x",
        "x" * 5000,
        "1 2",
        "::",
    ),
    *(
        "world::world",
        "__model__",
        "DefaultModelInstance",
        "<b>",
        "%s%n",
        "!!float ''",
        "1_000:2",
        "9" * 400,
    ),
)

Mutation = Callable[[bytes, np.random.Generator], bytes]


def pick(rng: np.random.Generator, values: Any) -> Any:
    """Return one of the values."""
    return values[int(rng.integers(len(values)))]


def plausible(value: float, rng: np.random.Generator) -> float:
    """Return another number of the same order, or of a wrong unit."""
    if rng.random() < 0.3:
        return value * 10.0 ** int(rng.integers(-3, 4))
    return float(value * rng.uniform(-1.5, 1.5) + (rng.random() < 0.3) * rng.normal(0.0, 0.3))


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes with a few changed, removed, repeated or truncated."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            break
        at = int(rng.integers(len(data)))
        length = int(rng.integers(1, 40))
        action = int(rng.integers(6))
        if action == 0:
            data[at] ^= 1 << int(rng.integers(8))
        elif action == 1:
            data[at] = int(rng.integers(256))
        elif action == 2:
            del data[at : at + length]
        elif action == 3:
            data[at:at] = data[at : at + length]
        elif action == 4:
            data[at:at] = str(pick(rng, NUMBERS)).encode()
        else:
            del data[at:]
    return bytes(data)


def _odd(value: Any, rng: np.random.Generator) -> Any:
    """Return another value in place of one: a number for a number, mostly."""
    if isinstance(value, int | float) and not isinstance(value, bool) and rng.random() < 0.8:
        if rng.random() < 0.5:
            return plausible(float(value), rng)
        return pick(rng, NUMBERS)
    if isinstance(value, str) and rng.random() < 0.8:
        return pick(rng, TEXTS)
    return pick(rng, (None, True, [], {}, [1], "x", 3.5, [[[]]], {"a": 1}, *NUMBERS[:6]))


def tree_mutated(tree: Any, rng: np.random.Generator) -> Any:
    """Return a tree of dicts and lists with one to three nodes changed."""
    for _ in range(int(rng.integers(1, 4))):
        places = list(_places(tree))
        if not places:
            return tree
        holder, key = pick(rng, places)
        action = rng.random()
        if action < 0.65:
            holder[key] = _odd(holder[key], rng)
        elif action < 0.75:
            del holder[key]
        elif action < 0.85 and isinstance(holder, list):
            holder.extend([holder[key]] * int(rng.integers(1, 50)))
        elif action < 0.9 and isinstance(holder, dict):
            holder[str(pick(rng, TEXTS))] = holder[key]
        else:
            other, there = pick(rng, places)
            if (isinstance(other, dict) and there in other) or (
                isinstance(other, list) and there < len(other)
            ):
                # A copy through JSON text: no node may contain itself.
                holder[key] = pickle.loads(pickle.dumps(other[there]))
    return tree


def _places(tree: Any) -> Any:
    """Yield every container and key below a node."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield tree, key
            yield from _places(value)
    elif isinstance(tree, list):
        for index, value in enumerate(tree):
            yield tree, index
            yield from _places(value)


def yaml_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a YAML file with nodes changed."""
    tree = tree_mutated(yaml.safe_load(content), rng)
    try:
        text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
    except (ValueError, yaml.YAMLError):
        return damaged(content, rng)
    return text.encode(errors="surrogatepass")


def xml_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return an XML file with elements, attributes and numbers changed."""
    root = ElementTree.fromstring(content)
    for _ in range(int(rng.integers(1, 4))):
        elements = list(root.iter())
        element = pick(rng, elements)
        action = rng.random()
        named = [(element, None)] if (element.text or "").strip() and not len(element) else []
        named += [(element, key) for key in element.attrib]
        if action < 0.7 and named:
            holder, key = pick(rng, named)
            text = holder.text if key is None else holder.attrib[key]
            text = _words_mutated(str(text), rng)
            if key is None:
                holder.text = text
            else:
                holder.attrib[key] = text
        elif action < 0.8 and len(element):
            element.remove(pick(rng, list(element)))
        elif action < 0.9 and len(element):
            child = pick(rng, list(element))
            for _ in range(int(rng.integers(1, 4))):
                element.append(pickle.loads(pickle.dumps(child)))
        elif action < 0.95:
            element.tag = pick(rng, ("pose", "size", "link", "joint", "axis", "x", "inertial"))
        elif len(element):
            element.append(pickle.loads(pickle.dumps(pick(rng, elements))))
    # An XML text cannot hold every character that a mutation writes; then it is no XML.
    return ElementTree.tostring(root, encoding="unicode").encode(errors="surrogatepass")


def _words_mutated(text: str, rng: np.random.Generator) -> str:
    words = text.split()
    if not words:
        return str(pick(rng, TEXTS))
    at = int(rng.integers(len(words)))
    try:
        number = float(words[at])
        odd = rng.random() < 0.5
        words[at] = str(pick(rng, NUMBERS) if odd else plausible(number, rng))
    except ValueError:
        words[at] = str(pick(rng, TEXTS))
    if rng.random() < 0.1:
        words.append(words[0])
    if rng.random() < 0.1:
        words.pop()
    return " ".join(words)


def csv_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a table with cells, rows or columns changed."""
    rows = [line.split(",") for line in content.decode().splitlines()]
    for _ in range(int(rng.integers(1, 4))):
        row = pick(rng, rows)
        if not row:
            continue
        at = int(rng.integers(len(row)))
        action = rng.random()
        if action < 0.75:
            row[at] = _words_mutated(row[at], rng)
        elif action < 0.85:
            del row[at]
        elif action < 0.95:
            rows.insert(int(rng.integers(len(rows))), list(row))
        else:
            for other in rows:
                del other[at : at + 1]
    return "\n".join(",".join(row) for row in rows).encode(errors="surrogatepass")


def obj_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a Wavefront OBJ with vertices and faces changed."""
    lines = content.decode().splitlines()
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(len(lines)))
        lines[at] = _words_mutated(lines[at], rng) if rng.random() < 0.8 else ""
    return "\n".join(lines).encode(errors="surrogatepass")


def stl_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a binary STL with its count or some coordinates changed."""
    data = bytearray(content)
    if rng.random() < 0.3:
        data[80:84] = np.uint32(pick(rng, (0, 1, 2**31, 2**32 - 1, 13))).tobytes()
    for _ in range(int(rng.integers(1, 6))):
        at = 84 + 4 * int(rng.integers((len(data) - 84) // 4))
        with np.errstate(over="ignore"):
            data[at : at + 4] = np.float32(float(pick(rng, NUMBERS))).tobytes()
    return bytes(data)


def joblib_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a joblib file of `tcs` with containers, shapes, types or numbers changed."""
    tree = joblib.load(io.BytesIO(content))
    arrays = [v for h, k in _places(tree) if isinstance(v := h[k], dict) and "bytes" in v]
    if rng.random() < 0.6 and arrays:
        array = pick(rng, arrays)
        action = int(rng.integers(5))
        if action == 0:
            array["shape"] = [int(pick(rng, (0, 1, 7, 2**28, 2**31))) for _ in array["shape"]]
        elif action == 1:
            array["type"] = pick(rng, ("u1", "u8", "f4", "f8", "O", "i8"))
        elif action == 2:
            array["bytes"] = _compressed_zeros()
            array["shape"] = [10**8 // int(array["type"][1])]
        else:
            array["bytes"] = _numbers_mutated(array, rng)
    else:
        tree = tree_mutated(tree, rng)
    buffer = io.BytesIO()
    joblib.dump(tree, buffer)
    return zlib.compress(buffer.getvalue(), 0)


@cache
def _compressed_zeros() -> Any:
    """Return the compressed bytes of 100 MB of zeros."""
    return np.frombuffer(zlib.compress(bytes(10**8), 1), dtype=np.uint8)


def _numbers_mutated(array: dict[str, Any], rng: np.random.Generator) -> Any:
    """Return the compressed bytes of an array with some bytes changed."""
    inner = bytearray(zlib.decompress(array["bytes"].tobytes()))
    for _ in range(int(rng.integers(1, 8))):
        if inner:
            inner[int(rng.integers(len(inner)))] = int(rng.integers(256))
    return np.frombuffer(zlib.compress(bytes(inner), 3), dtype=np.uint8)


def json_cell_mutated(content: bytes, rng: np.random.Generator) -> bytes:
    """Return a run file with its cells, or the JSON of its metadata, changed."""
    if rng.random() < 0.8:
        return csv_mutated(content, rng)
    return content.replace(b'""', json.dumps(str(pick(rng, TEXTS))).encode(), 1)
