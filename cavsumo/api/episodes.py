"""``RecordedEpisode``: an episode that was played again or kept, as a table and as a page."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from cavsumo.api.display import episode_html, episode_text
from cavsumo.batch.replay import Record
from cavsumo.batch.replaying import Located, play_again, play_back
from cavsumo.batch.shown import shown_site
from cavsumo.errors import InputError
from cavsumo.kept.minimising import MOST_REPLAYS, Minimised, minimised
from cavsumo.kept.sentence import in_words
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace, states

if TYPE_CHECKING:
    import pandas

COLUMNS = ("time", "body", "x", "y", "v", "o")


@dataclass(frozen=True, eq=False, repr=False)
class RecordedEpisode:
    """An episode with the tracks of all bodies.

    Attributes:
        record: its row and its plan.
        trace: its recorded frames.
        site: its place.
    """

    record: Record
    trace: Trace
    site: Site

    @property
    def run(self) -> int:
        """The number of the episode in its batch."""
        return self.record.run

    @property
    def row(self) -> Mapping[str, str]:
        """The row of the episode, as text."""
        return self.record.row

    @cached_property
    def frames(self) -> pandas.DataFrame:
        """All bodies at every timestep.

        Columns: ``time`` [s]; ``body``, its id: ego, tester0, ... or that of SUMO's traffic; ``x``,
        ``y`` of its centre [m]; ``v``, its speed [m/s]; ``o``, its heading [rad], anticlockwise
        from east.
        """
        import pandas

        seen = [
            (frame["time_s"], name, *state)
            for frame in self.trace.frames
            for _, name, state in states(frame)
        ]
        return pandas.DataFrame(seen, columns=list(COLUMNS))

    def html(self, file: str | os.PathLike[str]) -> None:
        """Write the episode as one page that any browser plays.

        Raises InputError when the file cannot be written.
        """
        from cavsumo.report.pages.replay.page import write_page

        write_page(self.record, self.trace, self.site, Path(file))

    def minimised(self, *, replays: int = MOST_REPLAYS) -> MinimalTest:
        """The smallest test that still fails the ego the same way; at most so many replays.

        Raises InputError for an episode that is no failure or not the same when it is played back.
        """
        return MinimalTest(minimised(self.record, _as_it_is, replays))

    def keep(self, file: str | os.PathLike[str]) -> None:
        """Play the episode back and write it as one file (.cavtest) that is played anywhere.

        Raises InputError when that is not possible.
        """
        from cavsumo.report.kept_files import write_kept_test

        there, site = play_back(self.record, _as_it_is)
        write_kept_test(Path(file), there, site)

    def __repr__(self) -> str:
        return episode_text(self.record, self.trace)

    def _repr_html_(self) -> str:
        return episode_html(self.record, self.trace)


@dataclass(frozen=True, eq=False, repr=False)
class MinimalTest:
    """The smallest failure to which an episode was reduced.

    Attributes:
        found: the episode before and after.
    """

    found: Minimised

    @property
    def sentence(self) -> str:
        """The test in words."""
        return in_words(self.found.after.plan, self.found.after.row, self.found.last)

    @property
    def replays(self) -> int:
        """How many candidates were played."""
        return self.found.replays

    @property
    def complete(self) -> bool:
        """Whether the test fails no more without any one of its parts."""
        return self.found.complete

    @property
    def episode(self) -> RecordedEpisode:
        """The smallest failure as an episode."""
        after = self.found.after
        assert after.trace is not None
        return RecordedEpisode(after, after.trace, self.found.site)

    def html(self, file: str | os.PathLike[str]) -> None:
        """Write before and after, side by side, as one page."""
        from cavsumo.report.pages.minimal.page import write_minimal_page

        write_minimal_page(self.found, Path(file))

    def keep(self, file: str | os.PathLike[str]) -> None:
        """Write the test as one file (.cavtest) that is played anywhere."""
        from cavsumo.report.kept_files import write_minimal_test

        write_minimal_test(Path(file), self.found)

    def __repr__(self) -> str:
        return f"<MinimalTest: {self.sentence}>"


def _as_it_is(record: Record) -> Record:
    """A record that has the present paths of its files."""
    return record


def played_again(record: Record) -> RecordedEpisode:
    """An episode once more; raises DivergenceError where it first differs."""
    trace, site = play_again(record)
    if trace is None:
        raise InputError(f"replay: run {record.run} ended in an error, there is nothing to show")
    return RecordedEpisode(record, trace, site)


def played_back(record: Record, located: Located) -> RecordedEpisode:
    """An episode whose recorded actions were played back; raises like ``play_back``."""
    there, site = play_back(record, located)
    assert there.trace is not None  # without one, nothing is played back
    return RecordedEpisode(there, there.trace, site)


def as_recorded(record: Record) -> RecordedEpisode:
    """A recorded episode; raises InputError when no frame was kept."""
    if record.trace is None:
        raise InputError(f"replay: no trace was kept of run {record.run}; it must be played")
    return RecordedEpisode(record, record.trace, shown_site(record.plan, record.trace))
