"""Temporal-logic formulas over named signals: their text, their meaning, what they speak of.

Nothing in here knows of assertions; ``assertions.formula`` watches episodes by them.
"""

from cavsumo.assertions.formulas.rules import Rule, rule
from cavsumo.assertions.formulas.semantics import NoNumber, View, robustness
from cavsumo.assertions.formulas.signals import SIGNALS, Moment

__all__ = ["SIGNALS", "Moment", "NoNumber", "Rule", "View", "robustness", "rule"]
