"""Result of a finished batch, as the summary takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.batch.estimating import EstimateFacts
from cavsumo.batch.searching import SearchFacts
from cavsumo.batch.tally import Tally


@dataclass(frozen=True)
class Ended:
    """Result of a finished batch.

    Attributes:
        name: which part of a study it is; empty for none.
        csv_file, tally, traces: its results, what was found, how many traces there are.
        reference: the driver that judged the failures, "none" if they were not judged.
        sequential: the number of episodes may depend on what they found, so the intervals must
            hold however it was decided to stop.
        cut_short: somebody stopped it.
        searches: by agent, the findings of its search.
        estimates: by agent, the result of its estimate.
        promises: by agent, the class of egos for which its forecasts hold.
    """

    name: str
    csv_file: Path
    tally: Tally
    traces: int = 0
    reference: str = "none"
    sequential: bool = False
    cut_short: bool = False
    searches: Mapping[str, SearchFacts] = field(default_factory=dict)
    estimates: Mapping[str, EstimateFacts] = field(default_factory=dict)
    promises: Mapping[str, str] = field(default_factory=dict)

    @property
    def judged(self) -> bool:
        """Whether failures were judged, so that the preventable ones are known."""
        return self.reference != "none"
