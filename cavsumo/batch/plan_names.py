"""Names in a plan, checked before anything heavy is imported."""

from __future__ import annotations

from cavsumo.agents.names import AGENT_NAMES
from cavsumo.assertions.names import ASSERTION_NAMES, is_formula
from cavsumo.egos.names import EGO_NAMES
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.errors import UnknownName
from cavsumo.model.bodies import kind_named
from cavsumo.model.scenario import NO_REFERENCE, BatchPlan


def check_names(plan: BatchPlan) -> None:
    """Raise UnknownName, with the nearest one, for a name that nothing has.

    What a colon tells where to find (``module:Class``, ``policy:FILE``) is looked for later, when
    it is built; so are formulas that stand in place of a name.
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
