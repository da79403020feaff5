"""Figures of the TCS paper, for comparison."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import as_file, files
from typing import Annotated, Literal

from pydantic import Field

from tcs.errors import DataFileError
from tcs.files.documents import Document, Number, read_document

Percent = Annotated[Number, Field(ge=0, le=100)]


class Published(Document):
    """A row of the paper's Table I [%]."""

    task: str
    environment: str
    mean: Percent
    std: Percent


class Compared(Document):
    """A row of the paper's Table III: mean and standard deviation [%], None for "N/A"."""

    task: str
    environment: str
    members: Literal[1, 2]
    without: tuple[Percent, Percent] | None = None
    """Without TC-manipulability."""
    with_: tuple[Percent, Percent] | None = Field(None, alias="with")
    """With TC-manipulability."""


class Exempt(Document):
    """A task whose p-value in the paper is not below the common bound."""

    task: str
    environment: str
    p: Number


class PValues(Document):
    """p-values that the paper reports."""

    below: Number
    but: tuple[Exempt, ...] = ()


class Paper(Document):
    """Tables I and III of the TCS paper."""

    source: str
    table_1: tuple[Published, ...]
    table_3: tuple[Compared, ...]
    p_values: PValues

    def published(self, task: str, environment: str) -> Published | None:
        """Return the row of Table I for a task and environment, None if there is none."""
        for row in self.table_1:
            if (row.task, row.environment) == (task, environment):
                return row
        return None

    def compared(self, task: str, environment: str, members: int) -> Compared | None:
        """Return the row of Table III for a task and a size of set, None if there is none."""
        for row in self.table_3:
            if (row.task, row.environment, row.members) == (task, environment, members):
                return row
        return None

    def rows(self) -> Sequence[tuple[str, str]]:
        """Return task and environment of the rows of Table I, in the paper's order."""
        return [(row.task, row.environment) for row in self.table_1]

    def compared_rows(self) -> Sequence[tuple[str, str]]:
        """Return task and environment of the tasks of Table III, in the paper's order."""
        return list(dict.fromkeys((row.task, row.environment) for row in self.table_3))


def load_paper() -> Paper:
    """Return the figures of the TCS paper."""
    with as_file(files("tcs_studies.output.report.robustness").joinpath("paper.yaml")) as path:
        where = f"paper file '{path.name}'"
        return read_document(path, Paper, where, DataFileError)
