"""A report as text: tables for the terminal, CSV, JSON, Markdown."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator

from rich.console import Console
from rich.measure import Measurement
from rich.padding import Padding
from rich.table import Table as Grid
from rich.text import Text

from cavsumo.report.analysis import Report
from cavsumo.report.cells import Table
from cavsumo.report.figures import COLUMNS, as_json, lines
from cavsumo.report.tables import tables

WIDTH, INDENT = 100, 2
WIDEST = 1000  # of tables whose figures need it; figures are never cut off
WORD = 28  # least width of a column of words


def as_table(report: Report) -> str:
    """Tables for people, 100 columns wide where the figures allow it."""
    return "\n".join(map(drawn, tables(report)))


def drawn(table: Table) -> str:
    """A table drawn by rich, indented under its title if it has one."""
    text = io.StringIO()  # rich would show it in a notebook instead
    console = Console(file=text, width=WIDTH, color_system=None, force_jupyter=False)
    indent = INDENT if table.title else 0
    if table.title:
        console.print(Text(table.title))
    grid = _grid(table)
    least = Measurement.get(console, console.options.update(width=WIDEST), grid).minimum
    console.width = max(WIDTH, least + indent)
    console.print(Padding(grid, (0, 0, 0, indent)), highlight=False)
    console.width = WIDTH
    for note in table.notes:
        console.print(Padding(Text(note), (0, 0, 0, indent)), highlight=False)
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().splitlines())


def _grid(table: Table) -> Grid:
    """A table drawn by rich; words equal to those above are left out."""
    grid = Grid(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for i, title in enumerate((*table.words, *table.numbers)):
        longest = max(len(cell) for cell in (title, *(row[i] for row in table.rows)))
        if i < len(table.words):
            grid.add_column(Text(title), overflow="fold", min_width=min(WORD, longest))
        else:
            grid.add_column(Text(title), justify="right", no_wrap=True, min_width=longest)
    above: list[str] = []
    for row in table.rows:
        grid.add_row(*(Text(cell) for cell in _without_repeats(list(row), above, table)))
        above = list(row)
    return grid


def _without_repeats(row: list[str], above: list[str], table: Table) -> list[str]:
    """The row without the leading words that the row above has as well."""
    shown = list(row)
    for i in range(table.heads):
        if row[: i + 1] != above[: i + 1]:
            break
        shown[i] = ""
    return shown


def as_markdown(report: Report) -> str:
    """Tables for documents and issue trackers."""
    return "\n".join("".join(f"{line}\n" for line in _markdown(t)) for t in tables(report))


def _markdown(table: Table) -> Iterator[str]:
    """One table."""
    yield f"## {table.title}"
    yield ""
    yield _markdown_row([*table.words, *table.numbers])
    yield _markdown_row(["---"] * len(table.words) + ["--:"] * len(table.numbers))
    for row in table.rows:
        yield _markdown_row(row)
    for note in table.notes:
        yield ""
        yield _escaped(note)


def _markdown_row(cells: Iterable[str]) -> str:
    """One line of it."""
    return "| " + " | ".join(_escaped(cell) for cell in cells) + " |"


def _escaped(text: str) -> str:
    """Text in which nothing is markup."""
    for sign in "\\|<>*_`[]":
        text = text.replace(sign, f"\\{sign}")
    return " ".join(text.split())


def as_csv(report: Report) -> str:
    """One figure a line, in full precision."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(lines(report))
    return text.getvalue()


def as_json_text(report: Report) -> str:
    """All figures, for programs."""
    return json.dumps(as_json(report), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


FORMATS: dict[str, Callable[[Report], str]] = {
    "table": as_table,
    "csv": as_csv,
    "json": as_json_text,
    "markdown": as_markdown,
}
