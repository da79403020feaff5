"""Every consumer takes every kind of score file; the table in the docs names what cannot be."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tcs.cli.app import app
from tests.chosen import some_of
from tests.composition.consumers import CONSUMERS, Given
from tests.composition.files import KINDS

DOCS = Path(__file__).resolve().parents[2] / "docs" / "composition.md"
IMPOSSIBLE: dict[tuple[str, str], str] = {
    ("two hands at once", "plan"): "one arm moves at a time",
    ("two hands at once", "motions"): "one arm moves at a time",
    ("two hands at once", "serve: plan"): "one arm moves at a time",
}
"""What the line of the refusal says, by how the kind of file begins and the consumer."""
CELLS = [(kind, consumer) for kind in KINDS for consumer in CONSUMERS]
QUICK = [
    (kind, list(CONSUMERS)[(5 * n + 3) % len(CONSUMERS)]) for n, kind in enumerate(list(KINDS)[::2])
]
"""Every other kind with one consumer, in turn: every consumer once."""


def run(*words: object) -> object:
    """Run `tcs` in this process and return its JSON; a refusal is an `AssertionError`."""
    result = CliRunner().invoke(app, [*map(str, words), "--json"])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def refusal_of(kind: str, consumer: str) -> str | None:
    """Return what the line of a refusal says, None if the consumer takes the kind."""
    found = (
        IMPOSSIBLE[key] for key in IMPOSSIBLE if kind.startswith(key[0]) and key[1] == consumer
    )
    return next(found, None)


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Function that returns the path of the file of a kind, made when it is first asked for."""
    paths: dict[str, Path] = {}

    def of(kind: str) -> Path:
        if kind not in paths:
            folder = tmp_path_factory.mktemp("composition")
            paths[kind] = KINDS[kind].make(folder, run)
        return paths[kind]

    return of


@pytest.mark.parametrize(("kind", "consumer"), some_of(CELLS, *QUICK))
def test_the_consumer_takes_the_file(made, tmp_path, kind, consumer):
    given, refusal = Given(made(kind), tmp_path, run), refusal_of(kind, consumer)
    if refusal is None:
        CONSUMERS[consumer](given)
        return
    with pytest.raises(Exception, match=refusal):
        CONSUMERS[consumer](given)


def test_the_quick_cells_have_every_consumer():
    assert {consumer for _, consumer in QUICK} == set(CONSUMERS)


def test_the_docs_name_what_is_impossible():
    """The first column of the table holds kinds of files, the second consumers."""
    rows = re.findall(r"^\| (.+?) \| (.+?) \| .+ \|$", DOCS.read_text(encoding="utf-8"), re.M)
    named = {
        (kind, consumer.strip(" `"))
        for kind, consumers in rows
        for consumer in consumers.split(",")
        if kind != "kind of file" and not kind.startswith("-")
    }
    assert named == set(IMPOSSIBLE)


@pytest.mark.parametrize("names", [KINDS, CONSUMERS], ids=["kinds", "consumers"])
def test_the_docs_list_every_kind_and_consumer(names):
    text = DOCS.read_text(encoding="utf-8")
    assert [name for name in names if not re.search(rf"^- {re.escape(name)}$", text, re.M)] == []
