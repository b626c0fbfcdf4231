"""Temporal-logic formulas over named signals: syntax, semantics, signals.

Independent of assertions; ``assertions.formula`` evaluates them on episodes. To read a formula
imports nothing heavy.
"""

from typing import TYPE_CHECKING

from cavsumo.assertions.formulas.rules import Rule, rule
from cavsumo.assertions.formulas.signals import SIGNALS, Moment
from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.assertions.formulas.semantics import NoNumber, View, robustness

__all__ = ["SIGNALS", "Moment", "NoNumber", "Rule", "View", "robustness", "rule"]

__getattr__ = lazily(
    __name__,
    dict.fromkeys(("NoNumber", "View", "robustness"), "cavsumo.assertions.formulas.semantics"),
)
