"""Which agents play in a batch: built from their names and parameters, with the bodies they own."""

from __future__ import annotations

from pathlib import Path

from cavsumo.agents import AGENTS, Agent
from cavsumo.agents.policy import make_agent, parameters_of, policy_file
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import Body, kind_named, model_of
from cavsumo.model.objects import is_object
from cavsumo.model.plugins import source_file
from cavsumo.model.scenario import BatchPlan, Scenario


def make_agents(plan: BatchPlan, label: str) -> list[Agent]:
    """The agents of one label, one for each team."""
    name = plan.cast[label]
    params = plan.agent_params(label, [p.name for p in parameters_of(name)])
    return [make_agent(name, params) for _ in teams(plan.scenario)]


def agent_files(plan: BatchPlan) -> list[Path]:
    """The files of the agents: those that are policies, and those that their parameters name."""
    files = []
    for label, name in plan.cast.items():
        if (file := policy_file(name)) is not None:
            files.append(file)
            continue
        if is_object(name):
            files += filter(None, [source_file(name)])
            continue
        params = plan.agent_params(label, [p.name for p in parameters_of(name)])
        files += [
            Path(str(params[key]))
            for key in getattr(AGENTS.get(name), "FILES", ())
            if key in params
        ]
    return files


def learners(plan: BatchPlan) -> frozenset[str]:
    """The labels of the agents that learn from episode to episode."""
    if plan.known is not None:
        return frozenset()
    return frozenset(n for n in plan.cast if any(a.learns for a in make_agents(plan, n)))


def teams(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """For each agent the indices of the bodies that it owns."""
    size = scenario.bodies_per_agent
    return tuple(tuple(range(i, i + size)) for i in range(0, scenario.testers, size))


def tester_bodies(scenario: Scenario) -> tuple[Body, ...]:
    """The testers' bodies, as an agent-body-effector model that was validated (Definition 1)."""
    kind = kind_named(scenario.kind)
    bodies = tuple(Body(f"tester{i}", kind) for i in range(scenario.testers))
    model_of({f"agent{a}": [bodies[i] for i in team] for a, team in enumerate(teams(scenario))})
    return bodies


def check_agents(plan: BatchPlan) -> None:
    """Build every agent once and account for every parameter, before anything starts."""
    known = {label: [p.name for p in parameters_of(name)] for label, name in plan.cast.items()}
    shared = {key for keys in known.values() for key in keys}
    qualified = {f"{label}.{key}" for label, keys in known.items() for key in keys}
    for key in plan.params:
        valid = qualified if "." in key else shared
        if key not in valid:
            raise UnknownName("parameter", key, valid, f"agent {' '.join(plan.agents)}")
    kind = kind_named(plan.scenario.kind)
    for label, name in plan.cast.items():
        if label != name and label in AGENTS:
            raise InputError(f"agent {label}={name}: the label is the name of another agent")
        for agent in make_agents(plan, label)[:1]:
            try:
                agent.check_bodies(kind, plan.scenario.bodies_per_agent)
            except ValueError as error:
                raise InputError(f"agent {label}: {error}") from error
