"""The choosers of a batch: for each agent that is told what to play, the search or the estimate."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from cavsumo.agents.names import EXPOSURE
from cavsumo.batch.estimating import Estimating
from cavsumo.batch.jobs import Memory
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.searches import search_of
from cavsumo.batch.searching import Searching
from cavsumo.errors import ResultsError


class Chooser(Protocol):
    """Chooses what an agent's episodes play from the rows of those before."""

    def ready(self, run: int) -> bool:
        """Whether it is known what an episode plays."""

    def memory(self, run: int) -> Memory:
        """The memories with which the agents play an episode for which that is known."""

    def told(self, row: Mapping[str, Any]) -> None:
        """Take up the row of an episode, in any order."""


def chooser(prepared: PreparedBatch, label: str) -> Searching | Estimating:
    """The chooser of an agent."""
    if prepared.cast[label].name == EXPOSURE:
        return Estimating(prepared, label)
    return search_of(prepared, label)


def chosen(
    prepared: PreparedBatch, label: str, rows: Iterable[Mapping[str, Any]], run: int
) -> Memory:
    """The memories with which the agents played an episode, from the rows before it.

    Raises ResultsError where rows are missing.
    """
    search = chooser(prepared, label)
    for row in rows:
        if row["agent"] == label and int(row["run"]) < run:
            search.told(row)
    if not search.ready(run):
        raise ResultsError(f"run {run} cannot be found again: rows before it miss")
    return search.memory(run)
