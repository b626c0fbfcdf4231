"""``Results``: a batch that was played or lies on disk, as tables, pages and a line of text."""

from __future__ import annotations

import os
import warnings
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cavsumo.api.display import ResultsSummary, results_html, results_text
from cavsumo.api.episodes import RecordedEpisode, as_recorded, played_again, played_back
from cavsumo.batch.located import located
from cavsumo.batch.replay import Record
from cavsumo.batch.replay import recorded as find_recorded
from cavsumo.batch.tally import Tally
from cavsumo.errors import InputError
from cavsumo.kept.cavtest import is_cavtest, read_cavtest
from cavsumo.model.objects import SentObject
from cavsumo.model.own_folders import OwnFolder, close_own
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.report.files import write_report_files
from cavsumo.report.order import ReportOptions
from cavsumo.report.pages.suite.page import write_suite_page
from cavsumo.report.suite_results import cases_in, told_of
from cavsumo.results.columns import COLUMNS
from cavsumo.results.failures import preventable_first
from cavsumo.results.present import placed_scenario
from cavsumo.results.reading import COMPLETE, read_results, whole_lines
from cavsumo.results.recorded_plan import recorded_plan
from cavsumo.results.rows import parameters_of

if TYPE_CHECKING:
    import pandas

REPORTS = {".md": "markdown", ".csv": "csv", ".json": "json", ".txt": "table"}


class TemporaryFolder:
    """A temporary folder for results without an output file.

    It is removed by ``close``, with this object, or with the process.
    """

    def __init__(self) -> None:
        own = OwnFolder("results")
        self.path = Path(own.name)
        self.close = weakref.finalize(self, close_own, own, os.getpid())


@dataclass(frozen=True, eq=False, repr=False)
class Results:
    """The results of a batch: what ``cavsumo.run`` returns and ``cavsumo.load`` reads.

    Attributes:
        file: the results file.
        trusted: whether a replay may use egos and assertions that only the file names.
        folder: the temporary folder in which the file lies; None for results with a place.
        objects: the agents, the ego and the assertions that were given as objects; a replay uses
            them.
    """

    file: Path
    trusted: bool = False
    folder: TemporaryFolder | None = None
    objects: tuple[SentObject, ...] = ()

    @cached_property
    def rows(self) -> pandas.DataFrame:
        """The episodes, a row each, by the numbers of their runs.

        Numbers are numbers, NaN for missing values. ``columns`` explains the columns.
        """
        table = read_results(self.file)
        return table.set_axis(table["run"].rename(None), axis="index")

    @cached_property
    def columns(self) -> pandas.DataFrame:
        """The columns of ``rows`` by name: the meaning of each, and the unit of its numbers."""
        import pandas

        said = [(column.meaning, column.unit) for column in COLUMNS.values()]
        return pandas.DataFrame(said, index=list(COLUMNS), columns=["meaning", "unit"])

    @property
    def failures(self) -> pandas.DataFrame:
        """The rows of failures: preventable ones first, then those that were not judged."""
        found = self.rows[self.rows["outcome"] == "violated"]
        return found.loc[[row["run"] for row in preventable_first(found.to_dict("records"))]]

    @cached_property
    def cases(self) -> pandas.DataFrame:
        """The cases of a suite: what became of each, and its parameters.

        ``avoided``: whether the ego touched nobody, None where that is not judged (``why``);
        ``impact_kmh``: its speed at contact; ``share``: of the speed of the test. InputError for
        results of no suite.
        """
        import pandas

        found = [
            {
                "case": one.name,
                "variation": one.variation,
                "avoided": one.avoided,
                "impact_kmh": one.impact,
                "share": one.share,
                "why": one.why,
            }
            for one in cases_in(self.file)
        ]
        given = [parameters_of(row) for row in self.rows.to_dict("records")]
        parameters = pandas.DataFrame(given).drop(columns="variation")
        numbers = {"impact_kmh": float, "share": float}
        return pandas.DataFrame(found).astype(numbers).join(parameters.apply(_numbers))

    @property
    def plan(self) -> BatchPlan:
        """The scenario, how often it was played, and by which agents."""
        return self._recorded[0]

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario that was played; ``cavsumo.run`` takes it for a network.

        Files that are not where they were are taken from the results.
        """
        return placed_scenario(*self._recorded, self.file)

    @property
    def manifest(self) -> Mapping[str, Any]:
        """The record that makes the results reproducible: status, files, versions, options."""
        return self._recorded[1]

    @cached_property
    def _recorded(self) -> tuple[BatchPlan, dict[str, Any]]:
        """Plan and manifest."""
        return recorded_plan(self.file)

    def replay(
        self,
        run: int,
        *,
        recorded: bool = False,
        playback: bool = False,
        net: str | os.PathLike[str] | None = None,
        routes: str | os.PathLike[str] | None = None,
    ) -> RecordedEpisode:
        """Play an episode again, and check bit for bit that it is the same.

        Args:
            run: its number.
            recorded: use the recorded frames without playing the episode.
            playback: play its recorded actions and traffic back, instead of asking its agent; needs
                its trace and the network, and no routes.
            net, routes: where the network and the routes are now, if not where they were.

        Raises:
            DivergenceError: the episode departs from its record; the message says where first.
            InputError: there is no such run, no frame of it was kept, or a file is missing; or
                both ``recorded`` and ``playback`` are wanted.
        """
        if recorded and playback:
            raise InputError("replay: recorded=True plays nothing and playback=True plays")
        found = find_recorded(self.file, run, None if self.trusted else ())

        def here(record: Record) -> Record:
            return located(record, _path(net), _path(routes), shown=recorded)

        if playback:
            return played_back(found, here)
        return as_recorded(here(found)) if recorded else played_again(here(found))

    def report(self, file: str | os.PathLike[str], *, by: str = "agent", replays: int = 20) -> None:
        """Write the evidence into a file: rates with intervals, comparisons, times, causes.

        Args:
            file: ending in .html for a page (with replays in a folder beside it), .md, .csv,
                .json or .txt for tables, .xml for JUnit.
            by: the column whose values are summary apart.
            replays: number of failures that have pages of their own, for a page.

        Raises InputError when the file cannot be written.
        """
        path = Path(file)
        if path.suffix == ".html":
            wanted = ReportOptions(by, html=path, replays=replays)
        elif path.suffix == ".xml":
            wanted = ReportOptions(by, junit=path)
        elif path.suffix in REPORTS:
            wanted = ReportOptions(by, REPORTS[path.suffix], output=path)
        else:
            endings = ", ".join((".html", ".xml", *REPORTS))
            raise InputError(f"report {str(path)!r}: expected a name that ends in {endings}")
        for problem in write_report_files([self.file], wanted).problems:
            warnings.warn(problem, stacklevel=2)

    def suite_page(self, file: str | os.PathLike[str]) -> None:
        """Write the results of a suite as a page: the grid of each test, coloured by impact speed.

        Raises InputError for results of no suite, and when the file cannot be written.
        """
        write_suite_page(told_of(self.file), cases_in(self.file), Path(file))

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        return results_text(self._summary)

    def _repr_html_(self) -> str:
        return results_html(self._summary)

    @cached_property
    def _summary(self) -> ResultsSummary:
        """The summary of the results."""
        tally, judged = Tally(), self.plan.reference != "none"
        tally.add_rows(row for _, row in whole_lines(self.file) if row is not None)
        return ResultsSummary(self.plan.scenario, tally, self.failures, judged, self._place)

    @property
    def _place(self) -> str:
        """The file of the results, and the status of an incomplete batch."""
        status = str(self.manifest.get("status"))
        words = ["" if self.folder else str(self.file), "" if status in COMPLETE else status]
        return ", ".join(filter(None, words))


def _numbers(column: pandas.Series) -> pandas.Series:
    """A column of words as numbers, where all are."""
    import pandas

    numbers = pandas.to_numeric(column, errors="coerce")
    return column if (numbers.isna() & column.notna()).any() else numbers


def _path(name: str | os.PathLike[str] | None) -> Path | None:
    """A path, None for none."""
    return None if name is None else Path(name)


def load(file: str | os.PathLike[str], *, trust: bool = False) -> Results | RecordedEpisode:
    """The results that lie in a file, of ``cavsumo.run`` or the command; or a kept test.

    Args:
        file: the results file (.csv); its manifest lies beside it. Or a kept test (.cavtest), which
            is an episode.
        trust: let ``replay`` use an ego or an assertion that only the file names: a command to
            run, a module to import or an address to connect to.

    Raises InputError when the file or its manifest is missing, foreign or damaged.
    """
    if is_cavtest(Path(file)):
        return as_recorded(read_cavtest(Path(file), None if trust else ()).record)
    results = Results(Path(file), trusted=trust)
    results.plan, results.rows  # noqa: B018  # what is wrong comes out here
    return results
