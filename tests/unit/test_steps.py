"""Steps of a command that takes long: when they are shown, and how on a terminal."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from cavsumo.cli.steps import SlowSteps, say_written

Capture = pytest.CaptureFixture[str]


class Terminal(io.StringIO):
    """A terminal that remembers what is written on it."""

    def isatty(self) -> bool:
        """It is one."""
        return True


def steps(*, quiet: bool = False) -> None:
    """Two steps, the second in two parts."""
    with SlowSteps(quiet=quiet) as told:
        told.begin("reading a.csv")
        told.begin("writing pages", "1 of 2")
        told.begin("writing pages", "2 of 2")


def test_what_is_quick_says_nothing(capsys: Capture) -> None:
    """Before its time has come."""
    steps()
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("terminal", [False, True])
def test_the_quiet_say_nothing(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """However long it takes."""
    monkeypatch.setattr("cavsumo.cli.steps.AFTER_S", 0.0)
    screen = Terminal()
    if terminal:
        monkeypatch.setattr(sys, "stderr", screen)
    steps(quiet=True)
    assert screen.getvalue() == ""
    if not terminal:
        assert capsys.readouterr() == ("", "")


def test_each_step_is_a_line_in_a_pipe(monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    """Once, however many parts it has; stdout belongs to the result."""
    monkeypatch.setattr("cavsumo.cli.steps.AFTER_S", 0.0)
    steps()
    assert capsys.readouterr() == ("", "cavsumo: reading a.csv ...\ncavsumo: writing pages ...\n")


def test_a_terminal_shows_how_far_a_step_is(
    monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    """In one line, which is taken away at the end."""
    monkeypatch.setattr("cavsumo.cli.steps.AFTER_S", 0.0)
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    steps()
    shown = screen.getvalue()
    assert shown.index("reading a.csv") < shown.index("1 of 2") < shown.index("2 of 2")
    assert shown.endswith("\x1b[2K")  # an empty line
    assert capsys.readouterr().out == ""


def test_files_that_were_written_are_named(capsys: Capture) -> None:
    """A line each, on stderr; none for what was not asked for, none with -q."""
    say_written([Path("a.html"), None, "a_replays/ (2 pages)"])
    say_written(["b.svg"], quiet=True)
    assert capsys.readouterr() == (
        "",
        "cavsumo: wrote a.html\ncavsumo: wrote a_replays/ (2 pages)\n",
    )
