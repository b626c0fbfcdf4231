"""Temporal-logic formulas over named signals: syntax, semantics, signals.

Independent of assertions; ``assertions.formula`` evaluates them on episodes.
"""

from cavsumo.assertions.formulas.rules import Rule, rule
from cavsumo.assertions.formulas.semantics import NoNumber, View, robustness
from cavsumo.assertions.formulas.signals import SIGNALS, Moment

__all__ = ["SIGNALS", "Moment", "NoNumber", "Rule", "View", "robustness", "rule"]
