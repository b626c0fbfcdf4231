"""A column of results.csv, and the finished episode from which its values are made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cavsumo.model.scenario import BatchPlan

if TYPE_CHECKING:  # the process that collects rows does not load SUMO
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.episode import Episode


@dataclass(frozen=True)
class FinishedEpisode:
    """An episode that was played, or that could not be played.

    Attributes:
        plan: of its batch.
        run, agent, seed: its number in the batch, the tester agent's label, its seed.
        episode: the episode; None if it could not be played.
        avoidability: the judgement by the reference driver; None if not requested.
        error: the reason why it could not be played, empty if it was.
    """

    plan: BatchPlan
    run: int
    agent: str
    seed: int
    episode: Episode | None = None
    avoidability: Avoidability | None = None
    error: str = ""


@dataclass(frozen=True)
class Column:
    """A column of results.csv.

    Attributes:
        name: as in the header; ends with the unit where there is one.
        meaning: the meaning of a cell, and when it is empty.
        unit: of its numbers, empty for none.
        value: the cell of a finished episode; None for an empty one.
        words: its cells are words, not numbers.
        since: the version of cavsumo that added it; results of versions before are without it.
    """

    name: str
    meaning: str
    unit: str
    value: Callable[[FinishedEpisode], Any]
    words: bool = False
    since: str = "0.1"

    @property
    def explanation(self) -> str:
        """The meaning with the unit."""
        return f"{self.meaning} [{self.unit}]" if self.unit else self.meaning


@dataclass(frozen=True)
class Measured:
    """A value that depends on the episode alone, not on its batch.

    Attributes:
        of: the value of an episode.
        unplayed: the value where the episode could not be played.
    """

    of: Callable[[Episode], Any]
    unplayed: Any = None

    def __call__(self, finished: FinishedEpisode) -> Any:
        return self.unplayed if finished.episode is None else self.of(finished.episode)
