"""The archive of a search as a map: a row for each side and speed, a column for each place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from cavsumo.report.explored import AlikeFailures, Explored, ExploredCell
from cavsumo.report.pages.report.links import LinkedRun
from cavsumo.results.alike import PLACE_BIN_M, SPEED_BIN_MPS
from cavsumo.results.failures import PREVENTABLE, UNPREVENTABLE

WORDS = {
    PREVENTABLE: "preventable failure",
    UNPREVENTABLE: "failure that a careful driver would not have prevented",
    "held": "test that the ego passed",
    "unfair": "unfair: came too late for anyone",
    "missed": "nobody met",
    "invalid": "invalid",
}


class ShownCell(NamedTuple):
    """A cell of the map; ``said``: the words of its tests, empty for a cell without any."""

    band: str
    many: int
    said: str
    page: str


class ShownGroup(NamedTuple):
    """A line of the table of failures that are alike."""

    words: str
    many: int
    preventable: int
    run: int
    page: str


class Archive(NamedTuple):
    """The map of one search.

    Attributes:
        title: whose search.
        places: heads of the columns.
        rows: side and speed of each line, and its cells.
        groups: the failures that are alike.
        share: how many cells have a test, of all.
        note: what the map leaves out.
    """

    title: str
    places: Sequence[str]
    rows: Sequence[tuple[str, str, Sequence[ShownCell]]]
    groups: Sequence[ShownGroup]
    share: str
    note: str


def archive(
    found: Explored, title: str, looks: Sequence[LinkedRun], runs: Mapping[int, int]
) -> Archive:
    """The map of a search.

    Args:
        looks: runs that may have a page of their replay.
        runs: the number of the run of each row of the evidence.
    """
    pages = {look.index: look.page for look in looks}
    cells = {(cell.side, cell.speed, cell.place): cell for cell in found.cells}
    rows = [
        (
            f"from the {side}" if side != "ahead" else side,
            f"{speed:.2g} to {speed + found.speed_step:.2g}",
            [_shown(cells.get((side, speed, at)), runs, pages) for at in found.places],
        )
        for side in found.sides
        for speed in reversed(found.speeds)
    ]
    total = len(rows) * len(found.places)
    note = f"In {found.unmoved} more tests nobody moved on the road." if found.unmoved else ""
    return Archive(
        title,
        [f"{at:g}" for at in found.places],
        rows,
        [_group(one, runs, pages) for one in found.failures],
        f"{len(cells)} of {total}",
        note,
    )


def _shown(
    cell: ExploredCell | None, runs: Mapping[int, int], pages: Mapping[int, str]
) -> ShownCell:
    """A cell with its words and, where there is one, the page of its best test."""
    if cell is None:
        return ShownCell("none", 0, "", "")
    tests = "1 test" if cell.count == 1 else f"{cell.count} tests"
    said = f"{tests}; the best, run {runs[cell.index]}: {WORDS[cell.band]}, grade {cell.grade:.2f}"
    return ShownCell(cell.band, cell.count, said, pages.get(cell.index, ""))


def _group(one: AlikeFailures, runs: Mapping[int, int], pages: Mapping[int, str]) -> ShownGroup:
    """A group in words, with the best of its tests that has a page."""
    best = next((i for i in one.indices if pages.get(i)), one.indices[0])
    side = one.side if one.side == "ahead" else f"from the {one.side}"
    speed = "" if one.slowest is None else f", {_range(one.slowest, one.fastest)} m/s"
    words = (
        f"{side}{speed}, {one.place:g} to {one.place + PLACE_BIN_M:g} m along the ego's path, "
        f"hit at {one.impact:g} to {one.impact + SPEED_BIN_MPS:g} m/s"
    )
    return ShownGroup(words, one.count, one.preventable, runs[best], pages.get(best, ""))


def _range(low: float, high: float | None) -> str:
    """Two speeds as one text."""
    ends = [f"{low:.1f}", f"{low if high is None else high:.1f}"]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)
