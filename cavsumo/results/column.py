"""A column of results.csv, and the finished episode that its values are made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cavsumo.model.scenario import BatchPlan

if TYPE_CHECKING:  # the process that collects rows loads no SUMO
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.loop import Episode


@dataclass(frozen=True)
class FinishedEpisode:
    """An episode that was played, or that could not be played.

    Attributes:
        plan: of its batch.
        run, agent, seed: its number in the batch, the tester agent's label, its seed.
        fresh: it was played in a simulation of its own.
        episode: what happened; None if it could not be played.
        avoidability: what the reference driver would have done; None if that was not asked.
        error: why it could not be played, empty if it was.
    """

    plan: BatchPlan
    run: int
    agent: str
    seed: int
    fresh: bool
    episode: Episode | None = None
    avoidability: Avoidability | None = None
    error: str = ""


@dataclass(frozen=True)
class Column:
    """A column of results.csv.

    Attributes:
        name: as in the header; ends with the unit where there is one.
        meaning: what a cell says, and when it is empty.
        unit: of its numbers, empty for none.
        value: what the cell of a finished episode holds; None for nothing.
        words: it holds words, not numbers.
    """

    name: str
    meaning: str
    unit: str
    value: Callable[[FinishedEpisode], Any]
    words: bool = False

    @property
    def explanation(self) -> str:
        """The meaning with the unit."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning


@dataclass(frozen=True)
class Measured:
    """A value that the episode alone tells, whatever batch it is of.

    Attributes:
        of: the value of an episode.
        unplayed: the value where the episode could not be played.
    """

    of: Callable[[Episode], Any]
    unplayed: Any = None

    def __call__(self, finished: FinishedEpisode) -> Any:
        return self.unplayed if finished.episode is None else self.of(finished.episode)
