"""The suites that there are, and the tests of one, as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from cavsumo.suites.cells import all_cells
from cavsumo.suites.files import read_suite, suite_file, suite_names


def listing(name: str | None) -> str:
    """One line for each suite, or for each test of one with the number of its cells."""
    if name is None:
        lines = {one: read_suite(suite_file(one)).title for one in suite_names()}
        return _columns([[*line] for line in lines.items()])
    suite = read_suite(suite_file(name))
    count = Counter((cell.test.name, cell.extended) for cell in all_cells(suite))
    rows = [["test", "standard", "extended", ""]]
    rows += [
        [test.name, str(count[test.name, False]), str(count[test.name, True]), test.title]
        for test in suite.tests
    ]
    head = [f"{name}: {suite.title}", suite.source, suite.note]
    return "\n".join([*filter(None, head), _columns(rows)])


def _columns(rows: Sequence[Sequence[str]]) -> str:
    """Columns as wide as needed."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(f"{word:{width}}" for word, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    )
