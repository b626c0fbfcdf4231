"""The place of a recorded episode, for showing it without building its ego and assertions."""

from __future__ import annotations

import dataclasses

from cavsumo.agents.casting import shown_manoeuvres
from cavsumo.batch.prepared import approach_types
from cavsumo.egos import EGOS
from cavsumo.egos.base import EGO_KIND
from cavsumo.errors import ResultsError
from cavsumo.model.bodies import Kind, kind_named
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.network.site import Site, Wishes
from cavsumo.network.site_cache import site_of
from cavsumo.results.traces import Trace


def is_ours(scenario: Scenario) -> bool:
    """Whether the ego is built in, so that its box is known without a trace."""
    return scenario.ego in EGOS


def shown_site(plan: BatchPlan, trace: Trace | None) -> Site:
    """The site of a plan, without traffic and programs of lights, which are in the frames.

    An external ego has the box in a trace, else that of built-in egos. Raises
    InputError.
    """
    scenario, kind = plan.scenario, kind_named(plan.scenario.kind)
    types = approach_types(scenario, kind, shown_manoeuvres(plan))
    wishes = Wishes(kind=kind, types=types, jaywalk=scenario.jaywalk)
    ego = _ego_kind(scenario, trace)
    return site_of(scenario.net_file, scenario.ego_route, scenario.junction, ego, wishes)


def _ego_kind(scenario: Scenario, trace: Trace | None) -> Kind:
    """The ego's kind, with the right box."""
    if is_ours(scenario):
        return EGOS.make(scenario.ego, scenario.ego_params).kind
    if trace is None:
        return EGO_KIND
    try:
        _, length, width, wheelbase = trace.shapes()["ego"]
        return dataclasses.replace(EGO_KIND, length=length, width=width, wheelbase=wheelbase)
    except (KeyError, TypeError, ValueError) as error:
        raise ResultsError("the trace's head does not tell the ego's box") from error
