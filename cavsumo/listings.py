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
    if name is None:
        width = max(map(len, registry))
        return "\n".join(f"{n:{width}}  {registry.summary(n)}" for n in registry)
    lines = [f"{name}: {registry.summary(name)}"]
    shown = [(p, f"{p.name}={p.default}") for p in registry.parameters(name)]
    width = max((len(text) for _, text in shown), default=0)
    return "\n".join(lines + [f"  {text:{width}}  {p.doc}" for p, text in shown])
