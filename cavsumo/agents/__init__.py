"""Tester agents: one protocol (``base``), one registry, one file an algorithm.

Importing this package registers the agents that come with cavsumo.
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
from cavsumo.scene import Scene

__all__ = ["AGENTS", "Agent", "Scene"]
