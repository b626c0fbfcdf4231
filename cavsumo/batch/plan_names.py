"""Names in a plan, checked before heavy imports."""

from __future__ import annotations

from cavsumo.agents.names import AGENT_NAMES, policy_file
from cavsumo.assertions.formulas.rules import rule
from cavsumo.assertions.names import ASSERTION_NAMES, is_formula
from cavsumo.egos.names import EGO_NAMES, is_built_in
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import kind_named
from cavsumo.model.objects import is_object
from cavsumo.model.scenario import NO_REFERENCE, BatchPlan


def check_names(plan: BatchPlan) -> None:
    """Raise UnknownName, with the nearest name, for an unknown name, signals of formulas included.

    Names such as ``module:Class`` and ``exec:COMMAND`` are resolved later, when they are built; so
    are formulas in place of a name.
    """
    scenario = plan.scenario
    for name in plan.cast.values():
        _check_agent(name)
    if is_built_in(scenario.ego):
        EGO_NAMES.check(scenario.ego)
    kind_named(scenario.kind)
    if plan.reference != NO_REFERENCE and plan.reference not in REFERENCE_NAMES:
        valid = {NO_REFERENCE, *REFERENCE_NAMES}
        raise UnknownName(REFERENCE_NAMES.sort, plan.reference, valid)
    for name, text in scenario.formulas.items():
        rule(name, text, scenario.step_length)
    known = {*ASSERTION_NAMES, *scenario.formulas}
    for name in scenario.assertions:
        if name not in known and ":" not in name and not is_formula(name):
            raise UnknownName(ASSERTION_NAMES.sort, name, known)


def _check_agent(name: str) -> None:
    """Refuse an agent that there is not, and a policy whose file is not there."""
    if is_object(name):
        return
    file = policy_file(name)
    if file is None:
        AGENT_NAMES.check(name)
        return
    try:
        file.open("rb").close()
    except OSError as error:
        raise InputError(f"policy {str(file)!r}: {error.strerror}") from error
