from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import pytest
from pydantic import Field, model_validator

from tcs.errors import RobotError, UnknownNameError
from tcs.files.documents import (
    Document,
    Number,
    Placed,
    Size,
    checked,
    read_document,
    read_mapping,
)


class Leg(Placed):
    length: Size


class Table(Document):
    name: str
    height: Number = 0.7
    legs: tuple[Leg, ...] = ()
    by_name: Mapping[str, Leg] = {}
    feet: Annotated[tuple[int, ...], Field(min_length=2)] = (1, 2)
    foldable: Annotated[bool, Field(strict=True)] = False


def read(tmp_path, text):
    path = tmp_path / "table.yaml"
    path.write_text(text)
    content = read_mapping(path, "table", RobotError, known=Table.model_fields)
    return checked(content, Table, "table", RobotError, also_known=("based_on",))


def test_a_sound_file_becomes_a_value(tmp_path):
    table = read(tmp_path, "{name: a, height: 7e-1, legs: [{length: 1, rpy_deg: [0, 0, 180]}]}")
    assert table == Table(name="a", legs=(Leg(length=1.0, rpy_deg=(0.0, 0.0, 180.0)),))
    # Half a turn: rounding of one multiplication.
    assert table.legs[0].rpy == pytest.approx((0.0, 0.0, 3.141592653589793), abs=1e-15)
    with pytest.raises(ValueError, match="frozen"):
        table.height = 0.8


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[a]", "table must contain keys and values: name, height, legs, by_name, feet, foldable."),
        ("name: a\nheight: 1\nname: b", "line 3, column 1: key 'name' appears twice."),
        ("name: a\nlegs: [{length: 1, length: 2}]", "line 2, column 20: key 'length' appears"),
        ("1: a", "line 1, column 1: a key must be text."),
        ("height: 1", "table, field 'name' is missing."),
        ("{name: a, height: '1'}", "field 'height' is '1', but must be a valid number."),
        ("{name: a, height: yes}", "field 'height' is True, but must be a valid number."),
        ("{name: a, height: .nan}", "field 'height' is nan, but must be a finite number."),
        ("{name: a, legs: [4]}", "'legs[0]' is 4, but must be a mapping of keys to values."),
        ("{name: a, feet: []}", "field 'feet' is [], but must have at least 2 items."),
        ("{name: a, foldable: 3}", "field 'foldable' is 3, but must be a valid boolean."),
        ("{name: a, legs: 4}", "field 'legs' is 4, but must be a valid list."),
        (
            "{name: a, legs: [{length: 0}]}",
            "'legs[0].length' is 0 m, but a size must be 1e-06 to 100 m.",
        ),
        ("{name: 1, height: a}", "but must be a valid string. (1 more after this one.)"),
    ],
)
def test_a_wrong_file_gets_one_line_of_the_callers_error(tmp_path, text, message):
    with pytest.raises(RobotError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)
    assert str(caught.value).startswith("table")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "{nmae: a}",
            "table: unknown key 'nmae'. Known: based_on, by_name, feet, foldable, heig",
        ),
        ("{name: a, legs: [{lenght: 1}]}", "table, field 'legs[0]': unknown key 'lenght'. Known: "),
        ("{name: a, by_name: {x: {xy: 1}}}", "field 'by_name.x': unknown key 'xy'. Known: length"),
    ],
)
def test_an_unknown_key_is_reported_with_the_keys_known_there(tmp_path, text, message):
    with pytest.raises(UnknownNameError) as caught:
        read(tmp_path, text)
    assert message in str(caught.value)


class Choice(Document):
    chosen: str

    @model_validator(mode="after")
    def _is_known(self):
        if self.chosen != "a":
            raise UnknownNameError("choice", self.chosen, ["a"], where="field 'chosen'")
        return self


def test_an_unknown_name_is_reported_with_file_and_field(tmp_path):
    path = tmp_path / "choice.yaml"
    path.write_text("chosen: b")
    with pytest.raises(UnknownNameError, match=r"^choice file 'c', field 'chosen': unknown choice"):
        read_document(path, Choice, "choice file 'c'", RobotError)
    path.write_text("chosen: a")
    assert read_document(path, Choice, "choice file 'c'", RobotError) == Choice(chosen="a")
