"""Parsing the text of a formula into its tree, by recursive descent.

From the weakest binding to the strongest, left-associative except ``=>``, which is
right-associative::

    formula     = conditional { "<=>" conditional }
    conditional = either [ "=>" conditional ]
    either      = both { "or" both }
    both        = lasting { "and" lasting }
    lasting     = single [ ("until" | "since") [interval] single ]
    single      = "not" single | operator [interval] single | comparison
    operator    = "always" | "eventually" | "next" | "historically" | "once"
    comparison  = sum [ ("<" | "<=" | ">" | ">=" | "==" | "!=") sum ]
    sum         = product { ("+" | "-") product }
    product     = factor { ("*" | "/") factor }
    factor      = "-" factor | number | signal | function | "true" | "false" | "(" formula ")"
    function    = ("abs" | "min" | "max") "(" sum { "," sum } ")"
    interval    = "[" seconds "," (seconds | "inf") "]"

Synonyms are in ``words``. The types of nodes, number or truth value, are checked while parsing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Literal, TypeVar, cast

from cavsumo.assertions.formulas.nodes import (
    Arithmetic,
    Comparison,
    Conditional,
    Connective,
    Constant,
    Function,
    Interval,
    Node,
    Not,
    Number,
    NumberNode,
    Signal,
    Temporal,
    TruthNode,
    Until,
    is_number,
)
from cavsumo.assertions.formulas.words import FUTURE, KEYWORDS, PAST, Text, Word, words
from cavsumo.errors import UnknownName

DEEPEST = 40  # parentheses, negations and operators within each other
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
FUNCTIONS = ("abs", "min", "max")
T = TypeVar("T")


def parse(text: str, signals: Collection[str], where: str = "formula") -> TruthNode:
    """The tree of a formula over these signals.

    Raises InputError, beginning with ``where`` and the column, for anything else.
    """
    return _FormulaParser(Text(where, text), signals).whole()


class _FormulaParser:
    """A formula while it is parsed."""

    def __init__(self, text: Text, signals: Collection[str]) -> None:
        self._text, self._signals = text, signals
        self._words = words(text)
        self._next = self._depth = 0

    def whole(self) -> TruthNode:
        """All of it."""
        found = self._truth(self._formula)
        if self._word.sort != "end":
            self._expected("an operator or the end")
        return found

    # Words

    @property
    def _word(self) -> Word:
        return self._words[self._next]

    def _take(self, *texts: str) -> Word | None:
        """The next word, and pass it, if it is one of these."""
        word = self._word
        if word.sort == "end" or word.text not in texts:
            return None
        self._next += 1
        return word

    def _demand(self, text: str) -> Word:
        return self._take(text) or self._expected(repr(text))

    def _expected(self, what: str) -> Word:
        """Refuse the next word."""
        self._text.refuse(self._word.at, f"expected {what}, got {self._word}")

    def _deeper(self, read: Callable[[], T]) -> T:
        """Read a nested part."""
        self._depth += 1
        if self._depth > DEEPEST:
            self._text.refuse(self._word.at, f"more than {DEEPEST} levels within each other")
        found = read()
        self._depth -= 1
        return found

    def _number(self, read: Callable[[], Node]) -> NumberNode:
        """Read something that must be a number."""
        at = self._word.at
        return self._counted(read(), at)

    def _counted(self, node: Node, at: int) -> NumberNode:
        """A node that must be a number, as is known now."""
        if not is_number(node):
            self._text.refuse(at, "expected a number, got something true or false")
        return cast(NumberNode, node)

    def _truth(self, read: Callable[[], Node]) -> TruthNode:
        """Read something that must be true or false."""
        at = self._word.at
        return self._checked(read(), at)

    # Formulas

    def _formula(self) -> Node:
        at, node = self._word.at, self._conditional()
        while word := self._take("<=>"):
            left, right = self._checked(node, at), self._truth(self._conditional)
            node = Conditional(left, right, True, word.at)
        return node

    def _checked(self, node: Node, at: int) -> TruthNode:
        """A node that must be true or false, as is known now."""
        if is_number(node):
            self._text.refuse(at, "expected something true or false, such as x > 0, got a number")
        return cast(TruthNode, node)

    def _conditional(self) -> Node:
        at, node = self._word.at, self._either()
        if word := self._take("=>"):
            right = self._deeper(lambda: self._truth(self._conditional))
            node = Conditional(self._checked(node, at), right, False, word.at)
        return node

    def _either(self) -> Node:
        return self._joined("or", self._both)

    def _both(self) -> Node:
        return self._joined("and", self._lasting)

    def _joined(self, op: Literal["and", "or"], read: Callable[[], Node]) -> Node:
        at, node = self._word.at, read()
        if self._word.text != op:
            return node
        parts = [self._checked(node, at)]
        while self._take(op):
            parts.append(self._truth(read))
        return Connective(op, tuple(parts), at)

    def _lasting(self) -> Node:
        at, node = self._word.at, self._single()
        if word := self._take("until", "since"):
            within, left = self._interval(), self._checked(node, at)
            node = Until(left, self._truth(self._single), within, word.text == "since", word.at)
            if self._word.text in ("until", "since"):
                self._text.refuse(self._word.at, f"{self._word} after another needs parentheses")
        return node

    def _single(self) -> Node:
        if word := self._take("not"):
            return Not(self._deeper(lambda: self._truth(self._single)), word.at)
        if word := self._take(*FUTURE, *PAST):
            within = Interval() if word.text == "next" else self._interval()
            of = self._deeper(lambda: self._truth(self._single))
            return Temporal(word.text, within, of, word.at)
        return self._comparison()

    def _interval(self) -> Interval:
        """An interval in seconds; without one, from now on for ever."""
        word = self._take("[")
        if word is None:
            return Interval()
        begin = self._seconds()
        self._demand(",")
        end = math.inf if self._take("inf") else self._seconds()
        self._demand("]")
        if end < begin:
            self._text.refuse(word.at, f"the interval ends at {end:g} s, before {begin:g} s")
        return Interval(begin, end, word.at)

    def _seconds(self) -> float:
        word = self._word
        if word.sort != "number":
            self._expected("a number of seconds, not negative")
        self._next += 1
        return self._finite(word)

    # Numbers

    def _comparison(self) -> Node:
        at, node = self._word.at, self._sum()
        if word := self._take(*COMPARISONS):
            left = self._counted(node, at)
            node = Comparison(word.text, left, self._number(self._sum), word.at)
            if self._word.text in COMPARISONS:
                self._expected("'and' between two comparisons")
        return node

    def _sum(self) -> Node:
        return self._chained(("+", "-"), self._product)

    def _product(self) -> Node:
        return self._chained(("*", "/"), self._factor)

    def _chained(self, ops: tuple[str, ...], read: Callable[[], Node]) -> Node:
        at, node = self._word.at, read()
        while word := self._take(*ops):
            left = self._counted(node, at)
            node = Arithmetic(word.text, left, self._number(read), word.at)
        return node

    def _factor(self) -> Node:
        word = self._word
        if self._take("-"):
            return Function("-", (self._deeper(lambda: self._number(self._factor)),), word.at)
        if self._take("("):
            node = self._deeper(self._formula)
            self._demand(")")
            return node
        if word.sort == "number":
            self._next += 1
            return Number(self._finite(word), word.at)
        if word.sort != "name" or (word.text in KEYWORDS and word.text not in ("true", "false")):
            self._expected("a signal, a number or '('")
        self._next += 1
        return self._named(word)

    def _named(self, word: Word) -> Node:
        """The node for a name."""
        if word.text in ("true", "false"):
            return Constant(word.text == "true", word.at)
        if word.text in FUNCTIONS and self._word.text == "(":
            return self._function(word)
        if word.text not in self._signals:
            valid = (*self._signals, *FUNCTIONS, *FUTURE, *PAST, "until", "since", "not")
            raise UnknownName("signal", word.text, valid, self._text.place(word.at))
        return Signal(word.text, word.at)

    def _function(self, word: Word) -> Function:
        self._demand("(")
        parts = [self._deeper(lambda: self._number(self._sum))]
        while self._take(","):
            parts.append(self._deeper(lambda: self._number(self._sum)))
        self._demand(")")
        if (word.text == "abs") != (len(parts) == 1):
            wanted = "one number" if word.text == "abs" else "two or more numbers"
            self._text.refuse(word.at, f"{word.text} takes {wanted}, got {len(parts)}")
        return Function(word.text, tuple(parts), word.at)

    def _finite(self, word: Word) -> float:
        """The value of a number."""
        value = float(word.text)
        if math.isinf(value):
            self._text.refuse(word.at, f"{word.text} is too large")
        return value
