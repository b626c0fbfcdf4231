"""A formula as a rule of an episode: its trigger and its evaluation."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from cavsumo.assertions.formulas.nodes import (
    Conditional,
    Interval,
    Signal,
    Temporal,
    TruthNode,
    Until,
    walk,
)
from cavsumo.assertions.formulas.signals import SIGNALS
from cavsumo.assertions.formulas.steps import steps_of
from cavsumo.assertions.formulas.syntax import parse
from cavsumo.assertions.formulas.words import Text
from cavsumo.errors import InputError

NAME = re.compile(r"[A-Za-z_][\w-]*", re.ASCII)


class Occasion(NamedTuple):
    """The precondition of a rule ``always[a,b] (p => q)``.

    Attributes:
        precondition, consequence: p and q.
        first, last: the timesteps at which p triggers the rule; None for no last one.
    """

    precondition: TruthNode
    consequence: TruthNode
    first: int
    last: int | None


@dataclass(frozen=True)
class Rule:
    """A formula that is asserted.

    Attributes:
        name, text: as given.
        whole: the formula evaluated at the first timestep of an episode.
        lasting: the formula that must hold at every timestep for that, if it refers to no other
            timestep.
        occasion: when it is triggered; None: every episode is a test.
        signals: the names of the signals that it uses.
        dt: the timestep [s].
    """

    name: str
    text: str
    whole: TruthNode
    lasting: TruthNode | None
    occasion: Occasion | None
    signals: tuple[str, ...]
    dt: float

    def place(self, at: int) -> str:
        """The position of a letter of its text, in words."""
        return Text(f"formula {self.name}", self.text).place(at)


def rule(name: str, text: str, dt: float) -> Rule:
    """Read a formula; raises InputError that points at the column.

    A formula with ``=>`` outermost, and one without temporal operators, is meant at every
    timestep: ``always`` is put around it.
    """
    if not NAME.fullmatch(name):
        raise InputError(f"formula {name!r}: a name has letters, digits, - and _ only")
    source = Text(f"formula {name}", text)
    whole = parse(text, SIGNALS.keys(), source.where)
    _check_intervals(whole, source, dt)
    implies = isinstance(whole, Conditional) and not whole.both
    if implies or not _temporal(whole):
        whole = Temporal("always", Interval(), whole, whole.at)
    names = {node.name for node in walk(whole) if isinstance(node, Signal)}
    wanted = tuple(known for known in SIGNALS if known in names)
    return Rule(name, text, whole, _lasting(whole), _occasion(whole, dt), wanted, dt)


def _temporal(node: TruthNode) -> bool:
    """Whether it refers to other timesteps."""
    return any(isinstance(part, Temporal | Until) for part in walk(node))


def _lasting(whole: TruthNode) -> TruthNode | None:
    """The formula that ``always`` requires of each timestep alone."""
    if isinstance(whole, Temporal) and whole.op == "always" and not _temporal(whole.of):
        return whole.of if (whole.within.begin, whole.within.end) == (0.0, float("inf")) else None
    return None


def _occasion(whole: TruthNode, dt: float) -> Occasion | None:
    """The precondition of ``always (p => q)``."""
    if not (isinstance(whole, Temporal) and whole.op == "always"):
        return None
    if not isinstance(whole.of, Conditional) or whole.of.both:
        return None
    return Occasion(whole.of.left, whole.of.right, *steps_of(whole.within, dt))


def _check_intervals(whole: TruthNode, source: Text, dt: float) -> None:
    """Refuse intervals between two timesteps: always would be true there, eventually false."""
    for node in walk(whole):
        if isinstance(node, Temporal | Until):
            begin, end = steps_of(node.within, dt)
            if end is not None and end < begin:
                source.refuse(
                    node.within.at,
                    f"no timestep of {dt:g} s lies in [{node.within.begin:g}, "
                    f"{node.within.end:g}] s",
                )
