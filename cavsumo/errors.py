"""The errors of cavsumo, as one short tree.

::

    CavsumoError                shown to the user as one sentence, never as a traceback
    |-- InputError              the command line or an input file is wrong (exit status 2)
    |   |-- UnknownName         a name that no registry, network or file has
    |   `-- NetworkError        a network that cannot serve the test asked for
    |-- NoSuchAction            no action leads from one state to another (seed, eq. 22)
    |-- EgoError                the ego's controller raised or gave an invalid answer
    |-- AssertionFault          a user's assertion raised or gave an invalid judgement
    |-- AgentError              a tester agent raised or chose an action outside its space
    |-- SimulationError         SUMO refused a call, or the ego never entered the network
    |   `-- SimulationTaken     another world took the one simulation of this process
    |-- BranchError             a branch of an episode was refused, raised, died or took too long
    |-- DivergenceError         a replay departs from its record (exit status 1)
    |-- BatchError              a batch cannot continue; finished rows are kept (exit status 3)
    `-- ResultsError            results on disk are missing, foreign or damaged (exit status 2)
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from enum import IntEnum


class Exit(IntEnum):
    """Exit statuses of the command line, pytest's where they mean the same."""

    OK = 0  # every episode ran and the ego violated nothing
    VIOLATED = 1  # it violated an assertion at least once
    USAGE = 2  # the command line or an input file is wrong
    NOT_RUN = 3  # an episode could not be run
    INTERRUPTED = 130  # interrupted; finished rows are in the results


class CavsumoError(Exception):
    """Base of every error that cavsumo raises on purpose; its message gives a remedy."""


class InputError(CavsumoError):
    """The command line or an input file is wrong."""


class UnknownName(InputError):
    """A name that is not among the valid ones; the message suggests the nearest."""

    def __init__(self, what: str, name: str, valid: Iterable[str], where: str = "") -> None:
        self.name, self.valid = name, sorted(valid)
        place = f"{where}: " if where else ""
        super().__init__(f"{place}unknown {what} {shown(name)}{_hint(name, self.valid)}")


class NetworkError(InputError):
    """A network that cannot serve the test asked for."""


class NoSuchAction(CavsumoError, ValueError):
    """No action leads from the one state to the other."""


class EgoError(CavsumoError):
    """The ego's controller raised, or gave an invalid answer."""


class AssertionFault(CavsumoError):
    """A user's assertion or formula raised, or gave an invalid judgement."""


class AgentError(CavsumoError):
    """A tester agent raised, or chose an action outside its space."""


class SimulationError(CavsumoError):
    """SUMO refused a call, or the ego never entered the network."""


class SimulationTaken(SimulationError):
    """Another world of this process began an episode: a process has one simulation."""


class BranchError(CavsumoError):
    """A branch of an episode was refused, raised, died or took too long."""


class DivergenceError(CavsumoError):
    """A replay departs from its record; the message names the first difference.

    Attributes:
        step: the timestep; None when the frames agree and the row does not.
        body: id of the body, empty for a quantity without a body.
        quantity: x, y, v or o of a body, another key of a frame, or a column of the row.
    """

    def __init__(self, message: str, step: int | None, body: str, quantity: str) -> None:
        super().__init__(message)
        self.step, self.body, self.quantity = step, body, quantity


class BatchError(CavsumoError):
    """A batch cannot continue: a full disk, a lost scheduler, no process to simulate in."""


class ResultsError(InputError):
    """Results on disk are missing, foreign or damaged."""


LONGEST = 500  # characters of a message; what is longer loses its middle
SHOWN = 80  # characters of a value in a message


def shown(value: object) -> str:
    """A value as a message quotes it, not too long."""
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested, or with more digits than are printed
        text = f"a {type(value).__name__}"
    return text if len(text) <= SHOWN else text[:SHOWN] + "..."


def plain(error: BaseException) -> str:
    """An error in words; one of the system as the file and the reason, without its number."""
    if not (isinstance(error, OSError) and error.strerror):
        return str(error)
    named = isinstance(error.filename, str | bytes | os.PathLike)
    return f"{shown(os.fsdecode(error.filename))}: {error.strerror}" if named else error.strerror


def sentence(error: BaseException) -> str:
    """The message of an error as one line, without its middle when it is very long."""
    text = " ".join(str(error).split())
    if len(text) <= LONGEST:
        return text
    return f"{text[: LONGEST * 2 // 3]} ... {text[-LONGEST // 4 :]}"


def _hint(name: str, valid: list[str]) -> str:
    """The nearest valid name, or all of them when there are few."""
    near = difflib.get_close_matches(name, valid, n=1, cutoff=0.5)
    if near:
        return f"; did you mean {near[0]!r}?"
    if valid and len(valid) <= 12:
        return "; valid: " + ", ".join(valid)
    return ""
