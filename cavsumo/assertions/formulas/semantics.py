"""The semantics of formulas: bounds on the robustness at every timestep of a trace.

Signal temporal logic (Maler and Nickovic 2004) with the robustness of Donze and Maler (2010, space
robustness) in discrete time, pointwise at the timesteps::

    rob(x > y)      = x - y             rob(not f)     = -rob(f)
    rob(f and g)    = min               rob(f or g)    = max
    rob(f => g)     = max(-rob f, rob g)
    rob(always[a,b] f)(i)     = min of rob(f)(j)  for j in i + [a, b]
    rob(eventually[a,b] f)(i) = max of rob(f)(j)  for j in i + [a, b]
    rob(f until[a,b] g)(i)    = max of min(rob(g)(j), min of rob(f)(k) for i <= k < j)
                                                  for j in i + [a, b]

historically, once and since are their mirror images in the past; there are no timesteps before the
first one, so that over an empty interval ``once`` is false and ``historically`` true.

**The sign is the verdict.** Robustness is never 0: on the bound of a comparison it is the smallest
positive number if the comparison holds there (>=, <=, ==), and its negative otherwise (>, <, !=).

**The end of a trace.** The continuation is unknown, so robustness is an interval from its least to
its greatest value over all continuations (Deshmukh et al. 2017, robust satisfaction intervals).
When the trace is ``closed``, because the episode is over, operators without an upper bound range
over the timesteps of the episode alone (the neutral view of Eisner et al. 2003), while the values
of an operator [a, b] beyond the end stay unknown. The greatest value is then the weak view: it is
negative only if the episode itself violates the formula.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from functools import reduce
from typing import NamedTuple

import numpy as np

from cavsumo.assertions.formulas.nodes import (
    Arithmetic,
    Comparison,
    Conditional,
    Connective,
    Constant,
    Function,
    Not,
    Number,
    NumberNode,
    Signal,
    Temporal,
    TruthNode,
    Until,
)
from cavsumo.assertions.formulas.steps import steps_of
from cavsumo.assertions.formulas.windows import Values, largest_ahead

Trace = Mapping[str, Values]
TINY = sys.float_info.min  # the smallest number that is kept at full precision


class Bounds(NamedTuple):
    """The least and the greatest robustness at each timestep over all continuations."""

    least: Values
    greatest: Values

    @property
    def opposite(self) -> Bounds:
        """Those of the negation."""
        return Bounds(-self.greatest, -self.least)


class NoNumber(ArithmeticError):
    """A quantity of a formula is not a number.

    Attributes:
        step: the first timestep at which it is none.
        at: the place of the operator in the text.
    """

    def __init__(self, step: int, at: int) -> None:
        super().__init__(step, at)
        self.step, self.at = step, at


class View(NamedTuple):
    """A trace, open or closed.

    Attributes:
        trace: the values of every signal named, all of the same length n.
        n: the number of timesteps.
        dt: length of a timestep [s].
        closed: the episode is over.
    """

    trace: Trace
    n: int
    dt: float
    closed: bool


def robustness(formula: TruthNode, view: View) -> Bounds:
    """The robustness of a formula at each timestep, arrays of length n.

    Raises NoNumber where arithmetic has no result, such as 0 / 0.
    """
    with np.errstate(all="ignore"):
        return _bounds(formula, view)


def _bounds(formula: TruthNode, view: View) -> Bounds:
    """``robustness`` without a guard around it."""
    match formula:
        case Constant(value=value):
            return _known(np.full(view.n, math.inf if value else -math.inf))
        case Comparison():
            return _known(_compared(formula, view))
        case Not(of=of):
            return _bounds(of, view).opposite
        case Connective(op=op, of=parts):
            join = np.minimum if op == "and" else np.maximum
            least, greatest = zip(*(_bounds(part, view) for part in parts), strict=True)
            return Bounds(reduce(join, least), reduce(join, greatest))
        case Conditional():
            return _conditional(formula, view)
        case Until():
            return _until(formula, view)
        case Temporal():
            return _temporal(formula, view)


def _known(values: Values) -> Bounds:
    """Bounds of a value that does not depend on the continuation."""
    return Bounds(values, values)


def _conditional(node: Conditional, view: View) -> Bounds:
    left, right = _bounds(node.left, view), _bounds(node.right, view)
    onward = _either(left.opposite, right)
    if not node.both:
        return onward
    back = _either(left, right.opposite)
    return Bounds(np.minimum(onward.least, back.least), np.minimum(onward.greatest, back.greatest))


def _either(a: Bounds, b: Bounds) -> Bounds:
    """The robustness of a disjunction."""
    return Bounds(np.maximum(a.least, b.least), np.maximum(a.greatest, b.greatest))


# Numbers


def _compared(node: Comparison, view: View) -> Values:
    """The robustness of a comparison, never 0."""
    a, b = _value(node.left, view), _value(node.right, view)
    margin = b - a if node.op in ("<", "<=") else a - b
    if node.op in ("==", "!="):
        margin = np.abs(margin) if node.op == "!=" else -np.abs(margin)
    close = ~(np.abs(margin) >= TINY)  # that is 0 or NaN: both infinite and equal
    if close.any():
        on_bound = TINY if node.op in (">=", "<=", "==") else -TINY
        margin[close] = np.where(a == b, on_bound, np.copysign(TINY, margin))[close]
    return margin


def _value(node: NumberNode, view: View) -> Values:
    """The value of a number at each timestep."""
    match node:
        case Number(value=value):
            return np.full(view.n, value)
        case Signal(name=name):
            found = view.trace[name]
        case Function(name=name, of=parts):
            found = _function(name, [_value(part, view) for part in parts])
        case Arithmetic():
            found = _arithmetic(node.op, _value(node.left, view), _value(node.right, view))
    if np.isnan(found).any():
        raise NoNumber(int(np.argmax(np.isnan(found))), node.at)
    return found


def _function(name: str, of: list[Values]) -> Values:
    if name == "-":
        return -of[0]
    if name == "abs":
        return np.abs(of[0])
    return reduce(np.minimum if name == "min" else np.maximum, of)


def _arithmetic(op: str, a: Values, b: Values) -> Values:
    match op:
        case "+":
            return a + b
        case "-":
            return a - b
        case "*":
            return a * b
        case _:
            return a / b


# Time


def _temporal(node: Temporal, view: View) -> Bounds:
    """always and historically are not eventually not and not once not."""
    of = _bounds(node.of, view)
    dual = node.op in ("always", "historically")
    of = of.opposite if dual else of
    begin, end = (1, 1) if node.op == "next" else steps_of(node.within, view.dt)
    if node.op in ("once", "historically"):
        found = Bounds(*(largest_ahead(x[::-1], begin, end)[::-1] for x in of))
    else:
        found = _eventually(of, begin, end, view)
    return found.opposite if dual else found


def _eventually(of: Bounds, begin: int, end: int | None, view: View) -> Bounds:
    """In a window ahead; the values after the last timestep are unknown."""
    least, greatest = (largest_ahead(x, begin, end) for x in of)
    if end is not None:
        greatest[max(0, view.n - end) :] = math.inf
    elif not view.closed:
        greatest[:] = math.inf
    return Bounds(least, greatest)


def _until(node: Until, view: View) -> Bounds:
    """f until[a,b] g is eventually[a,b] g and (f until[a,inf) g) (Donze, Ferrere and Maler 2013).

    The greatest robustness takes the continuation as true, the least as false.
    """
    f, g = _bounds(node.left, view), _bounds(node.right, view)
    begin, end = steps_of(node.within, view.dt)
    if node.past:
        mirrored = (
            _until_one(p[::-1], q[::-1], begin, end, -math.inf) for p, q in zip(f, g, strict=True)
        )
        return Bounds(*(found[::-1] for found in mirrored))
    beyond = -math.inf if view.closed and end is None else math.inf
    return Bounds(
        _until_one(f.least, g.least, begin, end, -math.inf),
        _until_one(f.greatest, g.greatest, begin, end, beyond),
    )


def _until_one(f: Values, g: Values, begin: int, end: int | None, beyond: float) -> Values:
    """The robustness of until when that of both is ``beyond`` after the last timestep."""
    n = len(f)
    found = np.empty(n)
    last = beyond
    values = zip(f[::-1].tolist(), g[::-1].tolist(), strict=True)
    for i, (p, q) in enumerate(values, 1):  # y(i) = max(g(i), min(f(i), y(i + 1)))
        last = max(q, min(p, last))
        found[n - i] = last
    if begin:  # f holds on the way, then it is met by begin timesteps later
        later = np.concatenate([found[begin:], np.full(min(begin, n), beyond)])
        found = np.minimum(-largest_ahead(-f, 0, begin - 1), later)
    if end is None:
        return found
    reached = largest_ahead(g, begin, end)
    if beyond > 0.0:
        reached[max(0, n - end) :] = math.inf
    return np.minimum(found, reached)
