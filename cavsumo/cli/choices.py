"""The names that options accept, by registry, without heavy imports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from cavsumo.agents.names import AGENT_NAMES, SEARCH_METHODS
from cavsumo.assertions.names import ASSERTION_NAMES
from cavsumo.egos.names import EGO_NAMES
from cavsumo.egos.reference.names import REFERENCE_NAMES
from cavsumo.model import named_networks
from cavsumo.model.bodies import KINDS
from cavsumo.model.scenario import NO_REFERENCE

CHOICES: Mapping[str, Callable[[], Iterable[str]]] = {
    "agent": lambda: AGENT_NAMES,
    "assertion": lambda: ASSERTION_NAMES,
    "ego": lambda: EGO_NAMES,
    "kind of body": lambda: KINDS,
    "network": named_networks.names,
    "search method": lambda: SEARCH_METHODS,
    "reference driver": lambda: (NO_REFERENCE, *REFERENCE_NAMES),
}
