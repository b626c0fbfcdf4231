"""How a field of the scenario record is offered: the mark that stands in its annotation."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Option:
    """A field's place on the command line; the rest is read from its type and its description.

    Attributes:
        group: heading of the command's help under which it stands.
        names: its names there, a short form first; ``--the-field`` if there are none.
        metavar: word for its value.
        unset: what holds when it is not given, of a field without a default of its own.
        separator: characters between values that are given at once; a field of several values
            without it is given by repeating the option.
        choices: the sort of things whose names it takes (``cli/choices``).
        environments: whether the environments take it as a keyword; None for as its record does.
    """

    group: str
    names: tuple[str, ...] = ()
    metavar: str | None = None
    unset: str = ""
    separator: str = ""
    choices: str = ""
    environments: bool | None = None
