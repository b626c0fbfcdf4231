"""Tester agents: the protocol (``base``), the registry, one file an algorithm.

``casting`` resolves the agents of a batch, ``planning`` holds the games that some of them play.
Agents see snapshots only: no SUMO, no assertions.
To add one: a file here, its name in ``names``; it is imported when one is built.
"""

from typing import TYPE_CHECKING

from cavsumo.model.lazily import lazily

if TYPE_CHECKING:
    from cavsumo.agents.base import AGENTS, Agent
    from cavsumo.model.scene import Scene

__all__ = ["AGENTS", "Agent", "Scene"]

__getattr__ = lazily(
    __name__,
    {
        "AGENTS": "cavsumo.agents.base",
        "Agent": "cavsumo.agents.base",
        "Scene": "cavsumo.model.scene",
    },
)
