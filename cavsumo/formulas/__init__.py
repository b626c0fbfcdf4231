"""Temporal-logic formulas over named signals: their text, their meaning, what they speak of.

Nothing in here knows of assertions; ``assertions.formula`` watches episodes by them.
"""

from cavsumo.formulas.rules import Rule, rule
from cavsumo.formulas.semantics import NoNumber, View, robustness
from cavsumo.formulas.signals import SIGNALS, Moment

__all__ = ["SIGNALS", "Moment", "NoNumber", "Rule", "View", "robustness", "rule"]
