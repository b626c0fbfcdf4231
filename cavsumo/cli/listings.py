"""Listings of agents, egos and assertions."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter
from typing import Any

from cavsumo.agents.names import AGENT_NAMES, policy_file
from cavsumo.assertions.names import ASSERTION_NAMES
from cavsumo.egos.names import EGO_NAMES, EXTERNAL_NAMES, is_built_in
from cavsumo.model.names import Names
from cavsumo.model.registry import Registry

NAMES: Mapping[str, Names] = {
    "agents": AGENT_NAMES,
    "egos": EGO_NAMES,
    "assertions": ASSERTION_NAMES,
}


def registries() -> dict[str, Registry[Any]]:
    """The registries by the plural of what they hold."""
    from cavsumo.agents import AGENTS
    from cavsumo.assertions import ASSERTIONS
    from cavsumo.egos import EGOS

    return {"agents": AGENTS, "egos": EGOS, "assertions": ASSERTIONS}


def listing(sort: str, name: str | None) -> str:
    """One line for each entry, or one entry with its parameters, defaults and units."""
    if name is not None and _is_declared(sort, name):
        NAMES[sort].check(name)
    registry = registries()[sort]
    if sort == "agents" and name is not None and name.startswith("policy:"):
        return _policy(name)
    if name is None:
        lines = {n: registry.summary(n) for n in registry}
        return "\n".join(_columns({**lines, **_forms(sort)}))
    if sort == "egos":
        registry = _registry_of(name, registry)
        name = name if name in registry else name.partition(":")[0]
    elif sort == "assertions":
        registry = _with_own(name)
    shown = {
        f"{p.name}={p.default}": p.doc
        for p in registry.parameters(name)
        if p.default is not Parameter.empty  # the part after the colon
    }
    return "\n".join(
        [f"{name}: {registry.summary(name)}", *(f"  {line}" for line in _columns(shown))]
    )


def _is_declared(sort: str, name: str) -> bool:
    """Whether a name must be in the table of its sort, without anything of the user's."""
    if sort == "egos":
        return name not in EXTERNAL_NAMES and is_built_in(name)
    return ":" not in name


def _columns(lines: Mapping[str, str]) -> list[str]:
    """Two columns, the first as wide as needed."""
    width = max(map(len, lines), default=0)
    return [f"{first:{width}}  {second}" for first, second in lines.items()]


def _forms(sort: str) -> Mapping[str, str]:
    """The forms of a user's name."""
    from cavsumo.assertions import specs as assertions
    from cavsumo.egos import specs as egos

    policies = {"policy:FILE": "a tester that you trained, in a policy file (.npz)"}
    forms = {"egos": egos.FORMS, "assertions": assertions.FORMS, "agents": policies}
    return forms.get(sort, {})


def _with_own(assertion: str) -> Registry[Any]:
    """The assertions, with the user's own if it is one."""
    from cavsumo.assertions.specs import registry_of

    return registry_of([assertion], {})


def _registry_of(ego: str, registered: Registry[Any]) -> Registry[Any]:
    """The registry of an ego's parameters: exec and tcp have their own."""
    from cavsumo.egos.external.ego import EXTERNAL

    return EXTERNAL if ego.partition(":")[0] in EXTERNAL else registered


def _policy(spec: str) -> str:
    """The description of a policy file."""
    from cavsumo.agents.policy_file import read_policy

    file = policy_file(spec)
    assert file is not None
    policy = read_policy(file)
    header = policy.header
    sizes = [len(policy.mean), *(len(biases) for _, biases in policy.layers)]
    facts: dict[str, str] = {
        "bodies": f"{header.bodies} {header.kind} a team",
        "actions": f"{header.actions}, each for {header.hold} timesteps",
        "network": f"{' > '.join(map(str, sizes))}, {header.activation}",
    } | {key: str(value) for key, value in header.metadata.items()}
    title = f"{spec}: a trained policy; what it is shown: cavsumo/agents/observations.py"
    return "\n".join([title, *(f"  {line}" for line in _columns(facts))])
