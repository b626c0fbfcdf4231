"""Egos from the user: a Python class named ``module:Class`` or an object, kept from doing harm.

The class is built with the ego's parameters as keywords. It has ``act(snapshot)``, which answers
``Acceleration`` or ``Drive``, and may have ``reset(scene)``, ``kind`` and ``depart_speed``. Of an
object every episode has a fresh copy, so that what it keeps changes no later episode.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cavsumo.egos.base import EGO_KIND, Command, Ego
from cavsumo.egos.effectors import checked, within
from cavsumo.errors import EgoError, InputError
from cavsumo.model.bodies import Kind
from cavsumo.model.objects import Copies
from cavsumo.model.plugins import imported, said
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot


class ControllerEgo(Ego):
    """Wraps a user's controller: whatever it does wrong becomes an EgoError with the time."""

    def __init__(self, spec: str, factory: Callable[..., Any], params: Mapping[str, Any]) -> None:
        self.spec = spec
        try:
            self.controller = factory(**params)
        except Exception as error:
            raise InputError(f"ego {spec}: cannot be built: {said(error)}") from error
        self._copies = factory if isinstance(factory, Copies) else None
        if not callable(getattr(self.controller, "act", None)):
            raise InputError(f"ego {spec}: has no method act(snapshot)")
        self.kind = getattr(self.controller, "kind", EGO_KIND)
        if not isinstance(self.kind, Kind):
            raise InputError(
                f"ego {spec}: kind must be a cavsumo.model.bodies.Kind, got {self.kind!r}"
            )
        speed = getattr(self.controller, "depart_speed", None)
        if speed is not None and not within(speed, 0.0, self.kind.v_max):
            raise InputError(f"ego {spec}: depart_speed must lie in [0, {self.kind.v_max:g}] m/s")
        self.depart_speed = speed
        self.sees_background = bool(getattr(self.controller, "sees_background", True))

    def reset(self, scene: Scene) -> None:
        self._sort: type | None = None
        try:
            if self._copies is not None:
                self.controller = self._copies()
            if hasattr(self.controller, "reset"):
                self.controller.reset(scene)
        except Exception as error:
            raise EgoError(f"ego {self.spec}: reset raised {said(error)}") from error

    def act(self, snapshot: Snapshot) -> Command:
        at = f"ego {self.spec} at {snapshot.time:.2f} s"
        try:
            command = self.controller.act(snapshot)
        except Exception as error:
            raise EgoError(f"{at}: act raised {said(error)}") from error
        try:
            checked(command, self._sort, self.kind)
        except EgoError as error:
            raise EgoError(f"{at}: {error}") from error
        self._sort = type(command)
        return command  # type: ignore[no-any-return]


def controller_class(spec: str) -> Callable[..., Any]:
    """Import ``module:Class``, the working folder included."""
    return imported(spec, f"ego {spec}", "class")
