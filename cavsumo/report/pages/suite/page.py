"""One page of a suite's results: a grid for each test, a cell for each case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from cavsumo.report.pages.shell import render, write
from cavsumo.report.suite_results import (
    AVOIDED,
    BANDS,
    LAST_BAND,
    NOT_JUDGED,
    CaseResult,
    SuiteTestResult,
    SuiteTold,
    results_of_tests,
)

FILES = Path(__file__).parent
SPEED, IN_LINE = "ego_kmh", 20
CORNERS = {SPEED: "ego [km/h]"}  # parameters by their names in pages
COLOURS = (AVOIDED, *(name for _, name in BANDS), LAST_BAND, NOT_JUDGED)


@dataclass(frozen=True)
class GridCell:
    """A case in its grid: text, the number of its colour, what the mouse shows."""

    text: str
    colour: int
    told: str


@dataclass(frozen=True)
class CaseGrid:
    """The grid of a test: a row for each value of the first parameter in the names of its cases,
    such as the speed of the ego, a column for the rest; lines of 20 for cases with a number alone.
    """

    test: str
    title: str
    corner: str
    result: SuiteTestResult
    columns: Sequence[str]
    rows: Sequence[tuple[str, Sequence[GridCell | None]]]


def write_suite_page(told: SuiteTold, cases: Sequence[CaseResult], file: Path) -> None:
    """Write the page; raises InputError when the file cannot be written."""
    write(suite_page(told, cases), file)


def suite_page(told: SuiteTold, cases: Sequence[CaseResult]) -> str:
    """The page of a suite's results."""
    results = {one.test: one for one in results_of_tests(cases)}
    grids = [
        _grid(test, told, results[test], list(found))
        for test, found in groupby(sorted(cases, key=lambda c: _order(c, told)), lambda c: c.test)
    ]
    return render(
        FILES,
        "suite",
        title=f"{told.title}: ego {told.ego}",
        told=told,
        results=list(results.values()),
        grids=grids,
        colours=list(enumerate(COLOURS)),
    )


def _order(case: CaseResult, told: SuiteTold) -> tuple[int, int]:
    """The order of the suite's file, then that of the results."""
    return list(told.tests).index(case.test), case.run


def _grid(test: str, told: SuiteTold, result: SuiteTestResult, cases: list[CaseResult]) -> CaseGrid:
    """The grid of a test."""
    by_name: dict[str, list[CaseResult]] = {}
    for case in cases:
        by_name.setdefault(case.name, []).append(case)
    parameters = told.named_by.get(test) or (SPEED,)
    place = _numbered if len(parameters) == 1 and parameters != (SPEED,) else _place
    places = {name: place(name) for name in by_name}
    rows = sorted({row for row, _ in places.values()}, key=_by_numbers)
    columns = sorted({column for _, column in places.values()}, key=_by_numbers)
    cells = {places[name]: _cell(found, told.file) for name, found in by_name.items()}
    table = [(row, [cells.get((row, column)) for column in columns]) for row in rows]
    corner = CORNERS.get(parameters[0], parameters[0])
    return CaseGrid(test, told.tests[test], corner, result, columns, table)


def _numbered(name: str) -> tuple[str, str]:
    """The row and the column of a case that has a number, in lines of so many."""
    try:
        line, column = divmod(int(name.partition("/")[2]) - 1, IN_LINE)
    except ValueError:
        return _place(name)
    return str(line * IN_LINE + 1), f"+{column}"


def _place(name: str) -> tuple[str, str]:
    """The row and the column of a case: the speed of the ego, and the rest of its name."""
    _, row, *rest = [*name.split("/"), ""]
    return row, " / ".join(filter(None, rest))


def _by_numbers(text: str) -> list[tuple[int, float, str]]:
    """Sort key: the words of a name, numbers by their values."""
    key = []
    for word in text.split(" / "):
        try:
            key.append((0, float(word), ""))
        except ValueError:
            key.append((1, 0.0, word))
    return key


def _cell(found: Sequence[CaseResult], file: str) -> GridCell:
    """The cell of a case with its variations; the worst of them gives the colour."""
    worst = max(found, key=lambda case: (COLOURS.index(case.band) % (len(COLOURS) - 1), case.run))
    if len(found) == 1 and worst.avoided is None:
        text = "–"
    elif len(found) == 1:
        text = AVOIDED if worst.impact is None else f"{worst.impact:.0f} km/h"
    else:
        text = f"{sum(bool(c.avoided) for c in found)} of {len(found)}"
        text += "" if worst.impact is None else f", {worst.impact:.0f} km/h"
    share = "" if worst.share is None else f", {worst.share:.0%} of the test's speed"
    why = f": {worst.why}" if worst.why else ""
    told = f"{worst.name}: {worst.band}{share}{why}; cavsumo replay {file} {worst.run}"
    return GridCell(text, COLOURS.index(worst.band), told)
