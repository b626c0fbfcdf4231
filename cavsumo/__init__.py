"""cavsumo: generates tests for autonomous vehicles in SUMO.

``docs/python.md`` describes ``cavsumo.run`` and the other public names, ``docs/architecture.md``
the rooms, in the order in which they may use each other. No room is imported before it is used, so
that ``import cavsumo`` is quick.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cavsumo.agents.base import Agent as Agent
    from cavsumo.api.episodes import RecordedEpisode as RecordedEpisode
    from cavsumo.api.estimating import Estimation as Estimation
    from cavsumo.api.estimating import estimate as estimate
    from cavsumo.api.kept import minimise as minimise
    from cavsumo.api.kept import regress as regress
    from cavsumo.api.results import Results as Results
    from cavsumo.api.results import load as load
    from cavsumo.api.running import run as run
    from cavsumo.api.running import run_study as run_study
    from cavsumo.api.running import search as search
    from cavsumo.api.suites import suite as suite
    from cavsumo.api.transferring import transfer as transfer
    from cavsumo.assertions.base import Assertion as Assertion
    from cavsumo.assertions.base import Judgement as Judgement
    from cavsumo.egos.base import Acceleration as Acceleration
    from cavsumo.egos.base import Drive as Drive
    from cavsumo.egos.base import Ego as Ego
    from cavsumo.errors import CavsumoError as CavsumoError
    from cavsumo.errors import DivergenceError as DivergenceError
    from cavsumo.errors import InputError as InputError
    from cavsumo.model.bodies import Action as Action
    from cavsumo.model.scenario import Scenario as Scenario

__version__ = "0.1.0"

# The public names, by the modules in which they stand.
_PUBLIC = {
    "run": "api.running",
    "run_study": "api.running",
    "search": "api.running",
    "estimate": "api.estimating",
    "load": "api.results",
    "suite": "api.suites",
    "minimise": "api.kept",
    "regress": "api.kept",
    "transfer": "api.transferring",
    "Results": "api.results",
    "Estimation": "api.estimating",
    "RecordedEpisode": "api.episodes",
    "Scenario": "model.scenario",
    "Agent": "agents.base",
    "Action": "model.bodies",
    "Ego": "egos.base",
    "Acceleration": "egos.base",
    "Drive": "egos.base",
    "Assertion": "assertions.base",
    "Judgement": "assertions.base",
    "CavsumoError": "errors",
    "InputError": "errors",
    "DivergenceError": "errors",
}
__all__ = [*_PUBLIC]

# Modules that version 0.1 had at the root and that users import, by their present names.
_MOVED = {
    "bodies": "model.bodies",
    "checks": "model.checks",
    "commands": "cli.commands",
    "contacts": "assertions.contacts",
    "ego_observations": "envs.ego_observations",
    "ego_rewards": "envs.ego_rewards",
    "executors": "batch.executors",
    "formulas": "assertions.formulas",
    "kinematics": "model.kinematics",
    "metrics": "assertions.metrics",
    "observations": "agents.observations",
    "policies": "agents.policy_file",
    "rewards": "simulation.rewards",
    "roads": "model.carriageway",
    "scene": "model.scene",
    "sensors": "model.sensors",
    "snapshot": "model.snapshot",
    "statistics": "results.statistics",
}


class _MovedModules(MetaPathFinder, Loader):
    """Imports a moved module by its old name: the same object as by its new one."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """The import of a moved module, or of one within a moved package."""
        package, _, rest = name.partition(".")
        moved = package == __name__ and rest.partition(".")[0] in _MOVED
        return ModuleSpec(name, self) if moved else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module by its new name, already loaded."""
        first, dot, rest = spec.name.removeprefix(f"{__name__}.").partition(".")
        module = import_module(f"{__name__}.{_MOVED[first]}{dot}{rest}")
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """The module is already loaded; it keeps the spec of its new name."""
        module.__spec__ = module.__spec__ and module.__spec__.loader_state


if not any(type(finder).__name__ == _MovedModules.__name__ for finder in sys.meta_path):
    sys.meta_path.insert(0, _MovedModules())


def __getattr__(name: str) -> Any:
    """A public name, loaded when it is first used (PEP 562)."""
    if name not in _PUBLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f"{__name__}.{_PUBLIC[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """The names that there are, loaded or not."""
    return sorted({*globals(), *__all__})
