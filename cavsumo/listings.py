"""What there is to choose from: agents, egos, assertions."""

from __future__ import annotations

from typing import Any

from cavsumo.registry import Registry


def registries() -> dict[str, Registry[Any]]:
    """The registries by the plural of what they hold."""
    from cavsumo.agents import AGENTS
    from cavsumo.assertions import ASSERTIONS
    from cavsumo.egos import EGOS

    return {"agents": AGENTS, "egos": EGOS, "assertions": ASSERTIONS}


def listing(sort: str, name: str | None) -> str:
    """One line for each entry, or one entry with its parameters, defaults and units."""
    registry = registries()[sort]
    if sort == "agents" and name is not None and name.startswith("policy:"):
        return _policy(name)
    if name is None:
        shown = [(n, registry.summary(n)) for n in registry]
        if sort == "agents":
            shown.append(("policy:FILE", "A tester that you trained, in a policy file (.npz)."))
        return _columns(shown)
    lines = [f"{name}: {registry.summary(name)}"]
    shown = [(f"  {p.name}={p.default}", p.doc) for p in registry.parameters(name)]
    return "\n".join([*lines, _columns(shown)] if shown else lines)


def _columns(shown: list[tuple[str, str]]) -> str:
    """Names and what they mean, below each other."""
    width = max(len(name) for name, _ in shown)
    return "\n".join(f"{name:{width}}  {text}" for name, text in shown)


def _policy(spec: str) -> str:
    """What a policy file says of itself."""
    from cavsumo.agents.policy import policy_file
    from cavsumo.policies import read_policy

    file = policy_file(spec)
    assert file is not None
    policy = read_policy(file)
    header = policy.header
    sizes = [len(policy.mean), *(len(biases) for _, biases in policy.layers)]
    facts = {
        "bodies": f"{header.bodies} {header.kind} a team",
        "actions": f"{header.actions}, each for {header.hold} timesteps",
        "network": f"{' > '.join(map(str, sizes))}, {header.activation}",
    } | {key: str(value) for key, value in header.metadata.items()}
    title = f"{spec}: a trained policy; what it is shown: cavsumo/observations.py"
    return "\n".join([title, _columns([(f"  {key}", text) for key, text in facts.items()])])
