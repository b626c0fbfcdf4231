"""The nodes of a formula: frozen records, each with its position in the text.

Numbers are ``Number``, ``Signal``, ``Arithmetic`` and ``Function``; all others are true or false.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias


@dataclass(frozen=True, slots=True)
class Number:
    """A number as written."""

    value: float
    at: int  # of its first letter in the text, from 0


@dataclass(frozen=True, slots=True)
class Signal:
    """A named signal (``signals``)."""

    name: str
    at: int


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """Two numbers joined by + - * or /."""

    op: str
    left: NumberNode
    right: NumberNode
    at: int


@dataclass(frozen=True, slots=True)
class Function:
    """``abs``, ``min`` or ``max`` of numbers, or ``-`` of one."""

    name: str
    of: tuple[NumberNode, ...]
    at: int


@dataclass(frozen=True, slots=True)
class Constant:
    """``true`` or ``false``."""

    value: bool
    at: int


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two numbers compared."""

    op: str
    left: NumberNode
    right: NumberNode
    at: int


@dataclass(frozen=True, slots=True)
class Not:
    """Negation."""

    of: TruthNode
    at: int


@dataclass(frozen=True, slots=True)
class Connective:
    """Two or more joined by ``and`` or ``or``."""

    op: Literal["and", "or"]
    of: tuple[TruthNode, ...]
    at: int


@dataclass(frozen=True, slots=True)
class Conditional:
    """``left => right``, or with ``both`` ``left <=> right``."""

    left: TruthNode
    right: TruthNode
    both: bool
    at: int


@dataclass(frozen=True, slots=True)
class Interval:
    """An interval relative to now [s]."""

    begin: float = 0.0
    end: float = math.inf
    at: int = 0


@dataclass(frozen=True, slots=True)
class Temporal:
    """A temporal operator on one formula: always, eventually, next, historically or once."""

    op: str
    within: Interval
    of: TruthNode
    at: int


@dataclass(frozen=True, slots=True)
class Until:
    """``left until right``, or with ``past`` ``left since right``."""

    left: TruthNode
    right: TruthNode
    within: Interval
    past: bool
    at: int


NumberNode: TypeAlias = Number | Signal | Arithmetic | Function
TruthNode: TypeAlias = Constant | Comparison | Not | Connective | Conditional | Temporal | Until
Node: TypeAlias = NumberNode | TruthNode


def is_number(node: Node) -> bool:
    """Whether a node is a number, not true or false."""
    return isinstance(node, Number | Signal | Arithmetic | Function)


def walk(node: Node) -> Iterator[Node]:
    """A node and all below it."""
    yield node
    match node:
        case Arithmetic() | Comparison() | Conditional() | Until():
            yield from walk(node.left)
            yield from walk(node.right)
        case Function(of=parts) | Connective(of=parts):
            for part in parts:
                yield from walk(part)
        case Not() | Temporal():
            yield from walk(node.of)
        case _:
            pass
