"""Gymnasium and PettingZoo environments for learning testers and egos.

Importing this package registers ``cavsumo/Tester-v0`` and ``cavsumo/Ego-v0`` with Gymnasium; so
does naming them with it, ``gymnasium.make("cavsumo.envs:cavsumo/Tester-v0", net=...)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cavsumo.envs.parallel import CavsumoParallelEnv

ENVIRONMENTS = {
    "cavsumo/Tester-v0": "cavsumo.envs.tester:TesterEnv",
    "cavsumo/Ego-v0": "cavsumo.envs.ego:EgoEnv",
}

__all__ = ["ENVIRONMENTS", "parallel_env"]


def parallel_env(**settings: Any) -> CavsumoParallelEnv:
    """A PettingZoo environment in which testers and ego act at once (``CavsumoParallelEnv``)."""
    from cavsumo.envs.parallel import CavsumoParallelEnv

    return CavsumoParallelEnv(**settings)


def _register() -> None:
    """Register the environments with Gymnasium, which loads their classes when they are made."""
    import gymnasium

    for name, entry in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry, disable_env_checker=False)


_register()
