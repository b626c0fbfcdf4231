"""Requirements on every ego, agent and assertion, as checks and as pytest classes (``contracts``).

pytest is loaded with the classes only: ``cavsumo check-ego`` plays the checks without it. No SUMO
is needed. To add a check: a function in one of the ``*_checks``, called by ``contracts``.
"""

from __future__ import annotations

from typing import Any

__all__ = ["AgentContract", "AssertionContract", "EgoContract"]


def __getattr__(name: str) -> Any:
    """One of the classes."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from cavsumo.testing import contracts

    return getattr(contracts, name)
