"""Tables of how many tests and failures differ: cells, and one run of each to look at."""

from __future__ import annotations

from cavsumo.batch.sentences import many
from cavsumo.batch.summary import percent
from cavsumo.report.analysis import Report
from cavsumo.report.cells import Labels, Table
from cavsumo.report.distinct import Diversity
from cavsumo.results.alike import PLACE_BIN_M, SPEED_BIN_MPS

SHOWN = 10  # cells of failures


def distinct_table(report: Report, labels: Labels) -> Table:
    """How many differ."""
    rows, found = [], report.distinct
    for one in found:
        for what in report.events:
            diversity: Diversity = getattr(one, what)
            rows.append([*labels.cells(one), what, *_diversity_cells(diversity)])
    numbers = ("count", "cell known", "distinct", "estimated", "next is new")
    notes = [
        f"A cell: closing speed in steps of {SPEED_BIN_MPS:g} m/s, side of the ego, its way so far "
        f"in steps of {PLACE_BIN_M:g} m, kind of tester; of tests at the trigger, of failures at "
        "the impact.",
        "Estimated: all cells there are, met or not, at least (Chao); next is new: by Good and "
        "Turing.",
    ]
    shown = [getattr(one, what) for one in found for what in report.events]
    missing = sum(diversity.total - diversity.known for diversity in shown)
    if missing:
        notes.append("Where no trace was kept the cell is not known.")
    words = (*labels.titles, "")
    return Table(
        "distinct", "How many are distinct", words, numbers, rows, notes, heads=len(words) - 1
    )


def _diversity_cells(diversity: Diversity) -> list[str]:
    """How many differ, in one group."""
    estimate = "" if diversity.estimate is None else f"{diversity.estimate:.0f}"
    counts = [diversity.total, diversity.known, diversity.cells]
    return [*map(str, counts), estimate, percent(diversity.new)]


def failures_table(report: Report) -> Table:
    """The most frequent cells of failures, each with one to look at."""
    rows, found, several = [], report.failures, len(report.evidence.batches) > 1
    judged = report.events[0] == "preventable"
    settings = any(one.cell.setting for one in found)
    for one in found[:SHOWN]:
        cell = one.cell
        run = f"{one.file} {one.run}" if several else str(one.run)
        speed = f"{cell.speed:g} to {cell.speed + SPEED_BIN_MPS:g}"
        place = f"{cell.place:g} to {cell.place + PLACE_BIN_M:g}"
        words = [cell.kind, cell.side, ", ".join(one.agents)]
        words = [cell.setting, *words] if settings else words
        counts = (one.preventable, one.count - one.preventable) if judged else (one.count,)
        rows.append([*words, speed, place, *map(str, counts), run])
    words = ["tester", "from", "found by"]
    notes = []
    if len(found) > SHOWN:
        rest = sum(one.count for one in found[SHOWN:])
        cells = many(len(found) - SHOWN, "more cell")
        are = "is" if rest == 1 else "are"
        notes.append(f"{many(rest, 'failure')} in {cells} {are} not shown.")
    notes.append(f"To see one: cavsumo replay {'RESULTS' if several else found[0].file} RUN")
    kinds = ("preventable", "others") if judged else ("failures",)
    numbers = ("at [m/s]", "met at [m]", *kinds, "run")
    words = ["setting", *words] if settings else words
    title = "Failures by cell, the most frequent first"
    title = "Failures by cell, those most often preventable first" if judged else title
    return Table("distinct", title, words, numbers, rows, notes)
