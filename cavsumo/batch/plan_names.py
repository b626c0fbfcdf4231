"""Names in a plan, checked before heavy imports."""

from __future__ import annotations

from cavsumo.agents.names import AGENT_NAMES, SEARCH, declared_parameters, policy_file
from cavsumo.assertions.formulas.rules import rule
from cavsumo.assertions.names import ASSERTION_NAMES, is_formula
from cavsumo.egos.names import check_ego
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import kind_named
from cavsumo.model.names import check_shared
from cavsumo.model.objects import is_object
from cavsumo.model.scenario import NO_REFERENCE, BatchPlan, Scenario


def searching(plan: BatchPlan) -> frozenset[str]:
    """The labels of the agents that search."""
    return frozenset(label for label, name in plan.cast.items() if name == SEARCH)


def check_names(plan: BatchPlan) -> None:
    """Raise UnknownName, with the nearest name, for an unknown name, those of parameters and of
    signals in formulas included.

    Names such as ``module:Class`` and ``exec:COMMAND`` are resolved later, when they are built; so
    are formulas in place of a name.
    """
    scenario = plan.scenario
    for name in plan.cast.values():
        _check_agent(name)
    _check_agent_params(plan)
    check_ego(scenario.ego, scenario.ego_params)
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
    _check_assertion_params(scenario)


def _check_agent_params(plan: BatchPlan) -> None:
    """Refuse parameters that no agent has; those of a user's agent are known when it is built."""
    known = {label: declared_parameters(name) for label, name in plan.cast.items()}
    declared = {label: own for label, own in known.items() if own is not None}
    if len(declared) == len(known):
        check_shared(plan.params, declared, f"agent {' '.join(plan.agents)}")


def _check_assertion_params(scenario: Scenario) -> None:
    """Refuse parameters that no assertion has, as those of agents; formulas have none."""
    known = {
        name: () if name in scenario.formulas else ASSERTION_NAMES.parameters(name)
        for name in scenario.assertions
    }
    declared = {name: own for name, own in known.items() if own is not None}
    if len(declared) == len(known):
        check_shared(scenario.assertion_params, declared, f"assertion {' '.join(known)}")


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
