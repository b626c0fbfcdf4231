"""The cases of a suite as names and parameters, and the selection of some."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TypeGuard

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.scenario.suite import SuiteChoice
from cavsumo.suites.expressions import Value
from cavsumo.suites.records import EXTENDED, Suite, SuiteTest

MOST = 1_000_000  # cases of a suite


@dataclass(frozen=True)
class SuiteCell:
    """A case before its scenario is made.

    Attributes:
        test: to which it belongs.
        name: such as CPNA/30/50.
        parameters: values by name.
        extended: whether it lies beyond the standard range.
    """

    test: SuiteTest
    name: str
    parameters: dict[str, Value]
    extended: bool


def all_cells(suite: Suite) -> Iterator[SuiteCell]:
    """All cells of a suite, in the order of its file."""
    for test in suite.tests:
        for cells in test.cells:
            for values in itertools.product(*cells.options()):
                parameters = dict(zip(cells.values, values, strict=True))
                name = case_name(test, parameters)
                yield SuiteCell(test, name, parameters, cells.range == EXTENDED)


def case_name(test: SuiteTest, parameters: dict[str, Value]) -> str:
    """The name of a case: its test and some of its parameters."""
    for key in test.case:
        if key not in parameters:
            raise UnknownName("parameter", key, parameters, f"test {test.name}: case")
    words = [f"{v:g}" if isinstance(v, float) else str(v) for v in map(parameters.get, test.case)]
    return "/".join((test.name, *words))


def selected_cells(suite: Suite, choice: SuiteChoice) -> list[SuiteCell]:
    """The cells that a choice selects; raises InputError if there are none.

    An unknown name in ``only`` is refused with the nearest one.
    """
    cells = list(itertools.islice(all_cells(suite), MOST))
    _check_names(suite, cells, choice)
    found = [cell for cell in cells if _is_chosen(suite, cell, choice)]
    if not found:
        hint = "" if choice.extended else "; --extended adds the cells beyond the standard range"
        raise InputError(f"suite {choice.name}: no case is left by the filters{hint}")
    return found


def _is_chosen(suite: Suite, cell: SuiteCell, choice: SuiteChoice) -> bool:
    """Whether a cell is selected; one that is named whole is so in any range."""
    if choice.speeds and cell.parameters.get(suite.speed) not in choice.speeds:
        return False
    if cell.name in choice.only:
        return True
    if cell.extended and not choice.extended:
        return False
    return not choice.only or any(_fits(cell, pattern) for pattern in choice.only)


def _fits(cell: SuiteCell, pattern: str) -> bool:
    """Whether a pattern names a cell or its test."""
    return fnmatchcase(cell.test.name, pattern) or fnmatchcase(cell.name, pattern)


def _check_names(suite: Suite, cells: Sequence[SuiteCell], choice: SuiteChoice) -> None:
    """Refuse a pattern that names nothing at all, and a speed that no case has."""
    for pattern in choice.only:
        if not any(_fits(cell, pattern) for cell in cells):
            what = "case" if "/" in pattern else "test"
            valid = [c.name for c in cells] if what == "case" else [t.name for t in suite.tests]
            raise UnknownName(what, pattern, valid, f"suite {choice.name}")
    speeds = {cell.parameters.get(suite.speed) for cell in cells}
    for speed in choice.speeds:
        if speed not in speeds:
            known = ", ".join(f"{v:g}" for v in sorted(v for v in speeds if _is_number(v)))
            raise InputError(
                f"suite {choice.name}: no case at {suite.speed} {speed:g}; there are {known}"
            )


def _is_number(value: Value | None) -> TypeGuard[float]:
    """Whether a parameter is a number."""
    return isinstance(value, int | float)
