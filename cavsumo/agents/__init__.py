"""Tester agents: the protocol (``base``), the registry, one file an algorithm.

``casting`` resolves the agents of a batch, ``planning`` holds the games that some of them play.
Importing this package registers the agents that come with cavsumo. Agents see snapshots only:
no SUMO, no assertions. To add one: a file here, its name in the import below.
"""

from cavsumo.agents import (  # noqa: F401  (imported to be registered)
    best_response,
    election,
    expectiminimax,
    programmed,
    qlearning,
    random,
    recorded,
)
from cavsumo.agents.base import AGENTS, Agent
from cavsumo.model.scene import Scene

__all__ = ["AGENTS", "Agent", "Scene"]
