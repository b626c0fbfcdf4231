"""Progress in a notebook: one bar below the cell, taken away in the end."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from cavsumo.batch.progress import Progress, in_notebook, is_shown
from cavsumo.batch.tally import Tally


class Cell:
    """The output below a cell."""

    def __init__(self) -> None:
        self.shown: list[str] = []

    def update(self, text: str) -> None:
        self.shown.append(text)


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> Cell:
    """A notebook, as far as IPython says so."""
    found = Cell()

    def display(text: str, display_id: bool) -> Cell:
        assert display_id
        assert found.shown == [], "one bar is enough"
        found.update(text)
        return found

    package: Any = ModuleType("IPython")
    package.get_ipython = lambda: SimpleNamespace(kernel=object())
    package.display = ModuleType("IPython.display")
    package.display.HTML, package.display.display = str, display
    monkeypatch.setitem(sys.modules, "IPython", package)
    monkeypatch.setitem(sys.modules, "IPython.display", package.display)
    return found


def play(episodes: int, *, quiet: bool = False) -> None:
    """Count so many episodes."""
    with Progress(episodes, quiet) as progress:
        for _ in range(episodes):
            progress.update(Tally())


def test_a_notebook_has_a_bar(cell: Cell, capfd: pytest.CaptureFixture[str]) -> None:
    """Drawn at most ten times a second, and nothing is printed."""
    assert in_notebook()
    assert is_shown()
    play(500)
    assert cell.shown[0].startswith('<progress value="1" max="500"></progress> 1/500 episodes, ')
    assert cell.shown[-1] == ""
    assert len(cell.shown) < 100
    assert capfd.readouterr() == ("", "")


def test_a_quiet_notebook_has_none(cell: Cell) -> None:
    """Neither a bar nor an empty place for it."""
    play(3, quiet=True)
    assert cell.shown == []


def test_elsewhere_lines_are_printed(capfd: pytest.CaptureFixture[str]) -> None:
    """On a pipe one for every tenth, which the command wants and the Python interface does not."""
    assert not in_notebook()
    assert not is_shown()
    play(30)
    assert capfd.readouterr().err.count("\n") == 10
