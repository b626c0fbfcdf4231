"""cavsumo: generates tests for autonomous vehicles in SUMO.

The rooms, in the order in which they may use each other, are listed in ``docs/architecture.md``.
No room is imported here, so that ``import cavsumo`` is quick.
"""

import sys
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

__version__ = "0.1.0"

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
