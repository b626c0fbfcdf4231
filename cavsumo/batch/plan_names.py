"""Names in a plan, checked before heavy imports."""

from __future__ import annotations

from cavsumo.agents.names import AGENT_NAMES
from cavsumo.assertions.names import ASSERTION_NAMES, is_formula
from cavsumo.egos.names import EGO_NAMES
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.errors import UnknownName
from cavsumo.model.bodies import kind_named
from cavsumo.model.scenario import NO_REFERENCE, BatchPlan


def check_names(plan: BatchPlan) -> None:
    """Raise UnknownName, with the nearest name, for an unknown name.

    Names with a colon (``module:Class``, ``policy:FILE``) are resolved later, when they are built;
    so are formulas in place of a name.
    """
    scenario = plan.scenario
    for name in plan.cast.values():
        if ":" not in name:
            AGENT_NAMES.check(name)
    if ":" not in scenario.ego:
        EGO_NAMES.check(scenario.ego)
    kind_named(scenario.kind)
    if plan.reference != NO_REFERENCE and plan.reference not in REFERENCE_NAMES:
        valid = {NO_REFERENCE, *REFERENCE_NAMES}
        raise UnknownName(REFERENCE_NAMES.sort, plan.reference, valid)
    known = {*ASSERTION_NAMES, *scenario.formulas}
    for name in scenario.assertions:
        if name not in known and ":" not in name and not is_formula(name):
            raise UnknownName(ASSERTION_NAMES.sort, name, known)
