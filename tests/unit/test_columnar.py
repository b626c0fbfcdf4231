"""Large results read by columns: what is accepted, and every sentence, as row by row."""

from __future__ import annotations

import csv
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from report_files import JUDGED, SOME, write

from cavsumo.batch.tally import COUNTED, Tally
from cavsumo.errors import ResultsError
from cavsumo.report import load as loading
from cavsumo.results import columnar
from cavsumo.results.columnar import CHECKED, Doubtful, blocks, check_table
from cavsumo.results.columns import COLUMNS
from cavsumo.results.reading import check_cells, read_rows, whole_lines

Change = Callable[[str], str]


@pytest.fixture(params=[200, 1 << 20], ids=["several blocks", "one block"])
def file(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A batch that is read in blocks of some bytes."""
    monkeypatch.setattr(columnar, "BLOCK", request.param)
    return write(tmp_path / "r.csv", [*SOME, *JUDGED], reference="human")


def cell(line: int, column: str, text: str) -> Change:
    """A change of one cell, its text as it is."""

    def change(content: str) -> str:
        lines = content.split("\n")
        cells = lines[line].split(",")
        cells[list(COLUMNS).index(column)] = text
        return "\n".join([*lines[:line], ",".join(cells), *lines[line + 1 :]])

    return change


CHANGES: dict[str, Change] = {
    "nothing": lambda content: content,
    "torn": lambda content: content[:-9],
    "header alone": lambda content: content[: content.index("\n") + 1],
    "torn header": lambda content: content[:40],
    "empty": lambda content: "",
    "other columns": lambda content: content.replace("agent", "tester", 1),
    "a blank line": lambda content: content + "\n",
    "a cell less": lambda content: content.replace(",held,", ",held", 1),
    "a cell more": lambda content: content.replace(",held,", ",held,,", 1),
    "a return": lambda content: content.replace("held", "held\r", 1),
    "an open quote": cell(3, "error", '"it broke'),
    "a quote inside": cell(3, "error", 'SUMO "broke"'),
    "a quoted comma": cell(3, "error", '"edge, ""1"""'),
    "a quoted run": cell(3, "run", '"2"'),
    "no run": cell(3, "run", ""),
    "a signed run": cell(3, "run", "+2"),
    "a run with a blank": cell(3, "run", "2 "),
    "a run with a zero": cell(3, "run", "02"),
    "a long run": cell(3, "run", "1234567890"),
    "a fraction of a seed": cell(3, "seed", "1.5"),
    "a seed with a point": cell(3, "seed", "7.0"),
    "a huge seed": cell(3, "seed", "99999999999999999999"),
    "no seed": cell(3, "seed", ""),
    "a word for a number": cell(3, "time_s", "soon"),
    "infinite": cell(3, "wall_s", "inf"),
    "not a number": cell(3, "lost_s", "nan"),
    "a power": cell(3, "wall_s", "1e5"),
    "another outcome": cell(3, "outcome", "passed"),
    "no trigger": cell(1, "trigger_time_s", ""),
    "two errors": lambda content: cell(1, "time_s", "late")(cell(4, "seed", "x")(content)),
    "other letters": cell(3, "error", "Mäkelänkatu\u2028"),
    "numbers as words": cell(3, "tester", "007"),
}


def outcome(work: Callable[[], object]) -> object:
    """A result, or the sentence of an error."""
    try:
        return work()
    except ResultsError as error:
        return str(error)


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())
def test_a_report_reads_the_same_by_columns_as_row_by_row(
    file: Path, change: Change, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same rows, or the same sentence."""
    file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8", newline="")

    def rows() -> object:
        found = loading.load([file]).rows
        return [[str(cell) for cell in row] for row in found.itertuples()]

    fast = outcome(rows)

    def refused(_: Path) -> None:
        raise Doubtful

    monkeypatch.setattr(loading, "blocks", refused)
    assert fast == outcome(rows)


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES.keys())
def test_checked_tables_are_rows_that_are_accepted(file: Path, change: Change) -> None:
    """By columns nothing is accepted that row by row is not, and its cells are the same."""
    file.write_text(change(file.read_text(encoding="utf-8")), encoding="utf-8", newline="")
    try:
        found = [block.table((*CHECKED, "error", "tester"), ("run",)) for block in blocks(file)]
        for table in found:
            check_table(table)
    except Doubtful:
        return
    rows = [row for _, row in whole_lines(file) if row is not None]
    for row in rows:
        check_cells(file, row)
    for name in ("run", "error", "tester"):
        cells = [str(cell) for table in found for cell in table[name]]
        assert cells == [str(int(r[name])) if name == "run" else r[name] for r in rows]


def test_an_undamaged_file_is_read_by_columns(file: Path) -> None:
    """Also one with quotes and with letters of other languages."""
    content = file.read_text(encoding="utf-8")
    for change in ("nothing", "torn", "a quoted comma", "other letters", "a run with a zero"):
        file.write_text(CHANGES[change](content), encoding="utf-8")
        lines = sum(len(block.ends) for block in blocks(file))
        assert lines == file.read_bytes().count(b"\n") - 1


def test_columns_that_were_added_since_are_empty(file: Path) -> None:
    """Results of the first version have fewer."""
    with file.open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    kept = [i for i, name in enumerate(header) if COLUMNS[name].since == "0.1"]
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerows([row[i] for i in kept] for row in [header, *rows])
    tables = [block.table(("lost_s", "seed"), ("seed",)) for block in blocks(file)]
    assert {cell for table in tables for cell in table["lost_s"]} == {""}
    seeds = [int(row[header.index("seed")]) for row in rows]
    assert [seed for table in tables for seed in table["seed"]] == seeds


@pytest.mark.parametrize("size", [1, 3, 100])
def test_rows_counted_together_are_those_counted_one_by_one(file: Path, size: int) -> None:
    """Counts, sums in their order, and the first rows of their kinds."""
    rng = random.Random(size)
    rows = [dict(rng.choice(read_rows(file)), lost_s=f"{rng.random():.3f}") for _ in range(100)]
    for row in rows:
        row["frozen"] = rng.choice(["", "", "stood"])
    alone, together = Tally(), Tally()
    for row in rows:
        alone.add(row)
    for start in range(0, len(rows), size):
        some = rows[start : start + size]
        columns = {name: [row[name] for row in some] for name in COUNTED}
        together.add_all(columns, some.__getitem__)
    assert vars(alone) == vars(together)
    assert list(alone.agents) == list(together.agents)
    assert alone.all.lost_s == sum_in_order(rows)


def sum_in_order(rows: list[dict[str, str]]) -> float:
    """The time lost in valid episodes, agent by agent."""
    totals = {
        agent: np.cumsum(
            [float(r["lost_s"]) for r in rows if r["agent"] == agent and counted(r)] or [0.0]
        )[-1]
        for agent in dict.fromkeys(row["agent"] for row in rows)
    }
    return float(np.cumsum([0.0, *totals.values()])[-1])


def counted(row: dict[str, str]) -> bool:
    """Whether an episode is valid."""
    return row["outcome"] not in ("error", "invalid")
